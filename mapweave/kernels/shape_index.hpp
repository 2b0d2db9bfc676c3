// Shape words of many maps by what they look like, and where a map's words say that it is in them. The twin and
// the words are in matching/shape_index.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace shape_index {

constexpr double kTurn = 6.283185307179586476925286766559;
constexpr int kSteps = 4096;      // of a turn that places are told by
constexpr double kFarthest = 320; // [m] from a map's origin; words beyond are left out
constexpr size_t kNone = SIZE_MAX;
constexpr size_t kFewCells = 40;  // of one map, that are all compared

// Angles are in 1/65536 of a turn, lengths in mm, places in cm: 16 bytes a word.
struct Word {
  uint32_t slot;
  int16_t x, y;
  uint16_t baseline, first, second, apart;
};

// What a word that is found says: where the middle of the map that is looked for is in a map.
struct Vote {
  uint32_t slot;
  int32_t x, y;
  int16_t step, turn;
  float place_x, place_y, weight;
};

struct Cell {
  uint64_t key;
  double votes, x, y, cosine, sine;
};

// Cells of one map by their key: a table that is small enough to stay near, and is emptied by counting on.
class Ballot {
 public:
  void clear(size_t votes) {
    size_t size = 64;
    while (size < 2 * votes) size *= 2;
    if (size > places_.size()) places_.assign(size, 0), since_ = 0;
    mask_ = size - 1;
    since_ += cells.size();
    cells.clear();
    if (since_ < (1u << 30)) return;
    std::fill(places_.begin(), places_.end(), 0);
    since_ = 0;
  }

  const Cell* find(uint64_t key) const {
    for (size_t at = spot(key);; at = (at + 1) & mask_) {
      if (places_[at] <= since_) return nullptr;
      if (cells[places_[at] - since_ - 1].key == key) return &cells[places_[at] - since_ - 1];
    }
  }

  Cell& at(uint64_t key) {
    size_t at = spot(key);
    while (places_[at] > since_ && cells[places_[at] - since_ - 1].key != key) at = (at + 1) & mask_;
    if (places_[at] <= since_) {
      cells.push_back({key, 0, 0, 0, 0, 0});
      places_[at] = static_cast<uint32_t>(since_ + cells.size());
    }
    return cells[places_[at] - since_ - 1];
  }

  std::vector<Cell> cells;

 private:
  size_t spot(uint64_t key) const { return (key * 0x9E3779B97F4A7C15ull >> 30) & mask_; }
  std::vector<uint32_t> places_;
  size_t since_ = 0, mask_ = 0;
};

class ShapeIndex {
 public:
  ShapeIndex(double longest, double length_bin, int64_t turn_bins, double margin, double length_tolerance,
             double turn_tolerance, double cell, int64_t cell_turns)
      : bin_(static_cast<int>(std::lround(1000 * length_bin))),
        lengths_(static_cast<int>(std::lround(1000 * longest)) / std::max(bin_, 1) + 1),
        turns_(static_cast<int>(turn_bins)),
        cell_turns_(static_cast<int>(cell_turns)),
        margin_(margin),
        cell_(cell),
        length_tolerance_(static_cast<int>(std::lround(1000 * length_tolerance))),
        turn_tolerance_(static_cast<int>(std::lround(turn_tolerance / kTurn * 65536))) {
    if (!(bin_ > 0 && turn_bins > 2 && turn_bins <= 360 && margin >= 0 && margin < 0.5 && cell > 1e-3 &&
          cell_turns > 2 && cell_turns <= 256 && longest > 0 && longest < 65))
      throw std::invalid_argument("bins above 0, margin in [0, 0.5), cell_turns in (2, 256], longest < 65 expected");
    buckets_.resize(static_cast<size_t>(lengths_) * turns_ * turns_ * 4);
    held_.assign(buckets_.size(), 0);
    for (int k = 0; k < kSteps; ++k) {
      cosine_[k] = std::cos(kTurn * k / kSteps);
      sine_[k] = std::sin(kTurn * k / kSteps);
    }
  }

  int64_t size() const { return static_cast<int64_t>(count_.size()); }

  // Takes the words of one more map; returns its slot.
  int64_t add(In<double, 2> words, In<int64_t, 1> kind) {
    const uint32_t slot = static_cast<uint32_t>(count_.size());
    int64_t held = 0;
    for (size_t k = 0; k < check(words, kind); ++k) {
      Word w;
      if (!packed(words.data() + 6 * k, slot, w)) continue;
      const int64_t bucket = key(w.apart / bin_, bin(w.first - w.baseline), bin(w.second - w.baseline), kind(k));
      if (bucket < 0) continue;
      buckets_[bucket].push_back(w);
      ++held_[bucket];
      ++held;
    }
    count_.push_back(held);
    alive_.push_back(true);
    total_ += held;
    return slot;
  }

  // Forgets the words of a map; its slot is not given again.
  void remove(int64_t slot) {
    if (slot < 0 || slot >= size() || !alive_[slot]) throw std::invalid_argument("slot: of a map expected");
    alive_[slot] = false;
    dead_ += count_[slot];
    if (2 * dead_ <= total_) return;
    for (size_t k = 0; k < buckets_.size(); ++k) {
      auto& bucket = buckets_[k];
      bucket.erase(std::remove_if(bucket.begin(), bucket.end(), [&](const Word& w) { return !alive_[w.slot]; }),
                   bucket.end());
      held_[k] = static_cast<int32_t>(bucket.size());
    }
    total_ -= dead_;
    dead_ = 0;
  }

  // Slots, transforms and votes of the places that a map's words say most.
  std::tuple<Out<int64_t>, Out<double>, Out<double>> places(In<double, 2> words, In<int64_t, 1> kind,
                                                            In<double, 1> middle, In<uint8_t, 1> allowed,
                                                            int64_t budget, int64_t count, double distance,
                                                            double turn) const {
    if (static_cast<int64_t>(allowed.shape(0)) != size() || middle.shape(0) != 2 || count < 0 || budget < 0)
      throw std::invalid_argument("allowed (slots,), middle (2,), count and budget >= 0 expected");
    start_.assign(count_.size() + 1, 0);
    votes_.clear();
    for (size_t rank = 0, rare = rarest(words, kind, budget); rank < rare; ++rank) {
      const Asked& asked = asked_[order_[rank].second];
      for (int k = 0; k < asked.count; ++k)
        for (const Word& w : buckets_[asked.bucket[k]])
          if (allowed(w.slot) && alive_[w.slot])
            vote(k < asked.forward ? asked.word : reversed(asked.word), w, asked.weight, middle.data());
    }
    sort_by_slot();
    lead(4 * static_cast<size_t>(count));
    return best(middle.data(), static_cast<size_t>(count), distance, turn);
  }

 private:
  // A word that is looked up, as it is and from its other end: 8 buckets each at most.
  struct Asked {
    Word word;
    double weight;
    int64_t found;
    int count, forward;
    std::array<int32_t, 16> bucket;
  };

  using Leader = std::pair<double, uint64_t>;  // votes and key of a cell

  static size_t check(const In<double, 2>& words, const In<int64_t, 1>& kind) {
    if (words.shape(1) != 6 || kind.shape(0) != words.shape(0))
      throw std::invalid_argument("words (n, 6), kind (n,) expected");
    return words.shape(0);
  }

  static uint16_t angle(double radians) {
    return static_cast<uint16_t>(static_cast<int64_t>(std::nearbyint(radians / kTurn * 65536)));
  }

  static bool packed(const double* w, uint32_t slot, Word& word) {
    for (int k = 0; k < 6; ++k)
      if (!std::isfinite(w[k]) || std::abs(w[k]) > kFarthest) return false;
    if (w[5] < 0 || w[5] > 65) return false;
    word = {slot,
            static_cast<int16_t>(std::nearbyint(100 * w[0])),
            static_cast<int16_t>(std::nearbyint(100 * w[1])),
            angle(w[2]),
            angle(w[3]),
            angle(w[4]),
            static_cast<uint16_t>(std::nearbyint(1000 * w[5]))};
    return true;
  }

  static Word reversed(const Word& w) {
    return {w.slot, w.x, w.y, static_cast<uint16_t>(w.baseline + 32768), w.second, w.first, w.apart};
  }

  int bin(int apart) const { return static_cast<int>((static_cast<uint32_t>(apart) & 0xFFFF) * turns_ >> 16); }

  int64_t key(int length, int first, int second, int64_t kind) const {
    if (length < 0 || length >= lengths_ || kind < 0 || kind > 3) return -1;
    return ((static_cast<int64_t>(length) * turns_ + first) * turns_ + second) * 4 + kind;
  }

  // -1, 0 or 1: towards which bin a value is near the edge of its own.
  int aside(double share) const { return share < margin_ ? -1 : share > 1 - margin_ ? 1 : 0; }

  int aside_turn(int apart) const {
    return aside(((static_cast<uint32_t>(apart) & 0xFFFF) * static_cast<uint32_t>(turns_) & 0xFFFF) / 65536.0);
  }

  void look_up(const Word& w, int64_t kind, Asked& asked) const {
    const int length = w.apart / bin_, first = bin(w.first - w.baseline), second = bin(w.second - w.baseline);
    const int side[3] = {aside(static_cast<double>(w.apart % bin_) / bin_), aside_turn(w.first - w.baseline),
                         aside_turn(w.second - w.baseline)};
    for (int m = 0; m < 8; ++m) {
      bool wanted = true;
      int step[3];
      for (int k = 0; k < 3; ++k) {
        step[k] = m >> k & 1 ? side[k] : 0;
        wanted &= !(m >> k & 1) || side[k] != 0;
      }
      if (!wanted) continue;
      const int64_t bucket = key(length + step[0], (first + step[1] + turns_) % turns_,
                                 (second + step[2] + turns_) % turns_, kind);
      if (bucket < 0 || held_[bucket] == 0) continue;
      asked.bucket[asked.count++] = static_cast<int32_t>(bucket);
      asked.found += held_[bucket];
    }
  }

  // Looks words up, and puts those first that are found least often; returns how many of these are within the budget.
  size_t rarest(const In<double, 2>& words, const In<int64_t, 1>& kind, int64_t budget) const {
    asked_.clear();
    for (size_t k = 0; k < check(words, kind); ++k) {
      Asked asked{};
      if (!packed(words.data() + 6 * k, 0, asked.word)) continue;
      look_up(asked.word, kind(k), asked);
      asked.forward = asked.count;
      look_up(reversed(asked.word), (kind(k) & 1) << 1 | kind(k) >> 1, asked);
      if (asked.found == 0) continue;
      asked.weight = std::log1p(static_cast<double>(total_) / static_cast<double>(asked.found));
      asked_.push_back(asked);
    }
    order_.clear();
    for (size_t k = 0; k < asked_.size(); ++k) order_.emplace_back(asked_[k].found, k);
    std::sort(order_.begin(), order_.end());
    size_t kept = 0;
    for (int64_t sum = 0; kept < order_.size() && (sum += order_[kept].first) <= budget; ++kept) {
      const Asked& asked = asked_[order_[kept].second];
      for (int n = 0; n < asked.count; ++n) __builtin_prefetch(buckets_[asked.bucket[n]].data());
    }
    return kept;
  }

  void vote(const Word& ours, const Word& theirs, double weight, const double* middle) const {
    if (std::abs(ours.apart - theirs.apart) > length_tolerance_) return;
    const int turned = static_cast<int16_t>(theirs.baseline - ours.baseline);
    const int one = static_cast<int16_t>(theirs.first - ours.first - turned);
    const int two = static_cast<int16_t>(theirs.second - ours.second - turned);
    if (std::abs(one) > turn_tolerance_ || std::abs(two) > turn_tolerance_) return;
    // Of three directions the mean: the baseline's and both walls'.
    const int angle = turned + static_cast<int>(std::nearbyint((one + two) / 3.0));
    const int step = ((angle + 8) >> 4) & (kSteps - 1);
    const double c = cosine_[step], s = sine_[step];
    const double dx = middle[0] - ours.x / 100.0, dy = middle[1] - ours.y / 100.0;
    const double x = theirs.x / 100.0 + c * dx - s * dy, y = theirs.y / 100.0 + s * dx + c * dy;
    votes_.push_back({theirs.slot, floor_of(x), floor_of(y), static_cast<int16_t>(step),
                     static_cast<int16_t>(step * cell_turns_ / kSteps), static_cast<float>(x), static_cast<float>(y),
                     static_cast<float>(weight)});
    ++start_[theirs.slot + 1];
  }

  // Puts the votes for each map together, in their order; `start_` becomes where each begins.
  void sort_by_slot() const {
    std::partial_sum(start_.begin(), start_.end(), start_.begin());
    sorted_.resize(votes_.size());
    next_.assign(start_.begin(), start_.end() - 1);
    for (const Vote& vote : votes_) sorted_[next_[vote.slot]++] = vote;
  }

  int32_t floor_of(double x) const { return static_cast<int32_t>(std::floor(x / cell_)) + 32768; }

  static uint64_t cell_key(uint64_t slot, int64_t x, int64_t y, int64_t turn) {
    return slot << 40 | (static_cast<uint64_t>(x) & 0xFFFF) << 24 | (static_cast<uint64_t>(y) & 0xFFFF) << 8 |
           static_cast<uint64_t>(turn);
  }

  // A cell together with those beside it, in the same order however these are found.
  Cell gathered(uint64_t key) const {
    std::array<const Cell*, 27> beside{};
    if (ballot_.cells.size() < kFewCells)
      scan(key, beside);
    else
      probe(key, beside);
    Cell sum{key, 0, 0, 0, 0, 0};
    for (const Cell* near : beside) {
      if (!near) continue;
      sum.votes += near->votes;
      sum.x += near->x;
      sum.y += near->y;
      sum.cosine += near->cosine;
      sum.sine += near->sine;
    }
    return sum;
  }

  // Few cells are sooner compared than 27 looked up.
  void scan(uint64_t key, std::array<const Cell*, 27>& beside) const {
    for (const Cell& near : ballot_.cells) {
      const int64_t dx = static_cast<int64_t>(near.key >> 24 & 0xFFFF) - static_cast<int64_t>(key >> 24 & 0xFFFF) + 1;
      const int64_t dy = static_cast<int64_t>(near.key >> 8 & 0xFFFF) - static_cast<int64_t>(key >> 8 & 0xFFFF) + 1;
      if (dx < 0 || dx > 2 || dy < 0 || dy > 2) continue;
      const int turned = static_cast<int>(near.key & 0xFF) - static_cast<int>(key & 0xFF);
      const int dt = (turned + 1 + cell_turns_) % cell_turns_;
      if (dt <= 2) beside[9 * dx + 3 * dy + dt] = &near;
    }
  }

  void probe(uint64_t key, std::array<const Cell*, 27>& beside) const {
    const uint64_t slot = key >> 40;
    const int64_t x = key >> 24 & 0xFFFF, y = key >> 8 & 0xFFFF, turn = key & 0xFF;
    for (int k = 0; k < 27; ++k)
      beside[k] = ballot_.find(
          cell_key(slot, x + k / 9 - 1, y + k / 3 % 3 - 1, (turn + k % 3 - 1 + cell_turns_) % cell_turns_));
  }

  // Finds the cells that are the most voted by themselves, and sums each with those beside it.
  void lead(size_t most) const {
    leaders_.clear();
    for (size_t slot = 0; slot + 1 < start_.size(); ++slot) {
      if (start_[slot] == start_[slot + 1]) continue;
      count_votes(slot);
      for (const Cell& cell : ballot_.cells) leaders_.emplace_back(cell.votes, cell.key);
    }
    if (leaders_.size() > most) {
      std::nth_element(leaders_.begin(), leaders_.begin() + static_cast<std::ptrdiff_t>(most), leaders_.end(),
                       [](const Leader& a, const Leader& b) {
                         return a.first != b.first ? a.first > b.first : a.second < b.second;
                       });
      leaders_.resize(most);
    }
    std::sort(leaders_.begin(), leaders_.end(), [](const Leader& a, const Leader& b) { return a.second < b.second; });
    sums_.clear();
    for (size_t k = 0; k < leaders_.size(); ++k) {
      const uint64_t slot = leaders_[k].second >> 40;
      if (k == 0 || slot != leaders_[k - 1].second >> 40) count_votes(slot);
      sums_.push_back(gathered(leaders_[k].second));
    }
  }

  // Counts the votes for one map.
  void count_votes(size_t slot) const {
    ballot_.clear(start_[slot + 1] - start_[slot]);
    for (size_t k = start_[slot]; k < start_[slot + 1]; ++k) count_vote(sorted_[k], ballot_);
  }

  void count_vote(const Vote& vote, Ballot& ballot) const {
    Cell& cell = ballot.at(cell_key(vote.slot, vote.x, vote.y, vote.turn));
    const double w = vote.weight;
    cell.votes += w;
    cell.x += w * vote.place_x;
    cell.y += w * vote.place_y;
    cell.cosine += w * cosine_[vote.step];
    cell.sine += w * sine_[vote.step];
  }

  static bool before(const Cell& a, const Cell& b) { return a.votes != b.votes ? a.votes > b.votes : a.key < b.key; }

  std::tuple<Out<int64_t>, Out<double>, Out<double>> best(const double* middle, size_t count, double distance,
                                                          double turn) const {
    const auto after = [](const Cell& a, const Cell& b) { return before(b, a); };
    std::make_heap(sums_.begin(), sums_.end(), after);  // not all of them are wanted
    std::vector<int64_t> slots;
    std::vector<double> transforms, votes;
    std::vector<std::array<double, 3>> kept;
    std::vector<size_t> older, newest(start_.size(), kNone);  // of the places that are kept, those of one map
    while (slots.size() < count && !sums_.empty()) {
      std::pop_heap(sums_.begin(), sums_.end(), after);
      const Cell cell = sums_.back();
      sums_.pop_back();
      const double x = cell.x / cell.votes, y = cell.y / cell.votes, theta = std::atan2(cell.sine, cell.cosine);
      const size_t slot = cell.key >> 40;
      bool differs = true;
      for (size_t k = newest[slot]; k != kNone && differs; k = older[k])
        differs = std::hypot(x - kept[k][0], y - kept[k][1]) > distance ||
                  std::abs(std::remainder(theta - kept[k][2], kTurn)) > turn;
      if (!differs) continue;
      older.push_back(newest[slot]);
      newest[slot] = kept.size();
      kept.push_back({x, y, theta});
      slots.push_back(static_cast<int64_t>(slot));
      votes.push_back(cell.votes);
      const double c = std::cos(theta), s = std::sin(theta);
      transforms.insert(transforms.end(), {x - c * middle[0] + s * middle[1], y - s * middle[0] - c * middle[1], theta});
    }
    const size_t n = slots.size();
    return {give(std::move(slots), {n}), give(std::move(transforms), {n, 3}), give(std::move(votes), {n})};
  }

  int bin_, lengths_, turns_, cell_turns_;
  double margin_, cell_;
  int length_tolerance_, turn_tolerance_;
  std::array<double, kSteps> cosine_, sine_;
  std::vector<std::vector<Word>> buckets_;
  std::vector<int32_t> held_;  // words in each bucket, close together
  std::vector<int64_t> count_;
  std::vector<uint8_t> alive_;
  int64_t total_ = 0, dead_ = 0;
  // Of the last query: their room is used again. Among thousands of buckets that grew the heap is in pieces, and
  // room that is asked for anew took a quarter of a query.
  mutable std::vector<Vote> votes_, sorted_;
  mutable std::vector<size_t> start_, next_;
  mutable std::vector<Asked> asked_;
  mutable std::vector<std::pair<int64_t, size_t>> order_;
  mutable std::vector<Leader> leaders_;
  mutable std::vector<Cell> sums_;
  mutable Ballot ballot_;
};

}  // namespace shape_index

inline void bind_shape_index(nb::module_& m) {
  using shape_index::ShapeIndex;
  nb::class_<ShapeIndex>(m, "ShapeIndex")
      .def(nb::init<double, double, int64_t, double, double, double, double, int64_t>(), nb::arg("longest"),
           nb::arg("length_bin"), nb::arg("turn_bins"), nb::arg("margin"), nb::arg("length_tolerance"),
           nb::arg("turn_tolerance"), nb::arg("cell"), nb::arg("cell_turns"))
      .def("__len__", &ShapeIndex::size)
      .def("add", &ShapeIndex::add, nb::arg("words"), nb::arg("kind"))
      .def("remove", &ShapeIndex::remove, nb::arg("slot"))
      .def("places", &ShapeIndex::places, nb::arg("words"), nb::arg("kind"), nb::arg("middle"), nb::arg("allowed"),
           nb::arg("budget"), nb::arg("count"), nb::arg("distance"), nb::arg("turn"));
}
