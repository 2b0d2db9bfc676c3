// Every shift of a map over another, in wide cells. The twin and the words are in matching/shifts.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "place_views.hpp"

namespace shifts {

constexpr int kFacings = 8;   // in wide cells: 45° each
constexpr double kCentimetre = 0.01;

constexpr int64_t kAtOnce = 16;   // cells added: rows go on with as many that say nothing, and so do all sums
constexpr int32_t kMost = 32767;  // that a narrow number holds: sixteen of them are added at a time
constexpr int64_t kBlock = 8;     // cells a side, of which walls are added together: around a map as many say nothing
constexpr int kTogether = 4;      // walls

using Span = std::pair<int64_t, int64_t>;

// What is added for some walls of a block: of each, what counts where from the block's first row and column on.
struct Group {
  const int16_t* worth[kTogether];
  int16_t metres[kTogether];
  int64_t rows;  // that any of them reaches

  // As the `k`th the wall that is so far `down` and `right`, and counts in `map`.
  template <typename Map>
  void take(int k, int facing, int32_t centimetres, int64_t down, int64_t right, const Map& map) {
    worth[k] = map.worth(facing) - down * map.stride() - right;
    metres[k] = static_cast<int16_t>(centimetres);
    rows = std::max(k > 0 ? rows : 0, map.rows() + down);
  }
};

// Adds the used parts of rows to those of sums, times metres. Whole numbers: no order of adding tells.
MAPWEAVE_WIDE inline void add_rows(int16_t* __restrict sums, int64_t stride, const Group& group, int64_t columns,
                                   const Span* used) {
  const int16_t m0 = group.metres[0], m1 = group.metres[1], m2 = group.metres[2], m3 = group.metres[3];
  const int16_t *r0 = group.worth[0], *r1 = group.worth[1], *r2 = group.worth[2], *r3 = group.worth[3];
  for (int64_t i = 0; i < group.rows; ++i) {
    const auto [first, last] = used[i / kBlock];
    for (int64_t k = first; k < last; k += kAtOnce)
      for (int64_t u = k; u < k + kAtOnce; ++u)
        sums[u] = static_cast<int16_t>(sums[u] + (m0 * r0[u] + m1 * r1[u]) + (m2 * r2[u] + m3 * r3[u]));
    sums += stride, r0 += columns, r1 += columns, r2 += columns, r3 += columns;
  }
}

// Adds the narrow sums to the wide ones; nothing is left in them.
MAPWEAVE_WIDE inline void move_up(int32_t* __restrict sums, int16_t* __restrict narrow, size_t count) {
  for (size_t k = 0; k < count; ++k) sums[k] += narrow[k], narrow[k] = 0;
}

inline bool any_above(const int32_t* sums, int64_t count, int32_t least) {
  int32_t most = least;
  for (int64_t k = 0; k < count; ++k) most = std::max(most, sums[k]);
  return most > least;
}

// The wide cells of places along a line, of which these are the turned coordinates' parts.
MAPWEAVE_WIDE inline void find_cells(int32_t* __restrict cells, const double* __restrict along, double across,
                                     double low, double width, size_t count) {
  for (size_t k = 0; k < count; ++k) cells[k] = static_cast<int32_t>((across + along[k] - low) / width);
}

struct Wall {
  int32_t row, column, facing;
  int32_t metres;  // [cm]

  uint32_t block() const { return static_cast<uint32_t>(row / kBlock) << 16 | static_cast<uint32_t>(column / kBlock); }
};

// Memory that is kept from one turn to the next, and from call to call: to ask for it anew takes longer than to fill it.
struct Memory {
  std::vector<int16_t> seen, worth[2], narrow;
  std::vector<std::pair<size_t, int>> near;  // cells near a wall: their places, and where that faces
  std::vector<int32_t> sums;
  std::vector<double> metres;  // all 0 between two maps

  // Lets go of it where it was much.
  void release() {
    constexpr size_t kKept = size_t{1} << 20;
    if (seen.capacity() + metres.capacity() + sums.capacity() > kKept) *this = Memory();
  }
};

// That cells are narrow enough for narrow sums, and samples in their raster.
inline void check(const place_views::PlaceView& view, double width, int64_t weight) {
  const double side = width / (2 * view.cell()) + 2;  // more cells than are looked at along a wide one
  if (2 * kTogether * static_cast<double>(std::max<int64_t>(weight, 1)) * side * side > kMost)
    throw std::invalid_argument("width: of fewer cells expected");
  for (size_t k = 0; k < view.samples(); ++k)
    if (!view.holds(view.sample(k)[0], view.sample(k)[1]))
      throw std::invalid_argument("samples: inside of the raster expected");
}

// A map at one turn, in wide cells: what a metre of wall counts in each, by the way it faces, from the far corner on
// where it is `reversed`; and its walls.
class WideMap {
 public:
  WideMap(const place_views::PlaceView& view, double turn, double width, int64_t directions, int64_t weight,
          bool reversed, Memory& memory)
      : cosine_(std::cos(turn)), sine_(std::sin(turn)), turns_(turn / 6.283185307179586476925286766559 + 2),
        width_(width), reversed_(reversed), worth_(memory.worth[reversed]) {
    frame(view);
    count_cells(view, directions, weight, memory);
    collect_walls(view, memory.metres);
  }

  double x() const { return x_; }
  double y() const { return y_; }
  int64_t rows() const { return rows_; }
  int64_t columns() const { return columns_; }
  const std::vector<Wall>& walls() const { return walls_; }
  // Rows are `stride` apart: around the map nothing is said.
  const int16_t* worth(int facing) const { return worth_.data() + facing * plane() + kBlock * stride() + kBlock; }
  // No worth is greater, whichever its sign.
  int32_t most() const { return most_; }
  int64_t stride() const { return columns_ + kAtOnce + 2 * kBlock; }
  // From where to where a block's rows say anything, of walls anywhere in a block of theirs.
  const Span* used() const { return used_.data(); }

 private:
  int64_t plane() const { return (rows_ + 2 * kBlock) * stride(); }

  void frame(const place_views::PlaceView& view) {
    double high[2] = {-1e300, -1e300}, low[2] = {1e300, 1e300};
    for (int corner = 0; corner < 4; ++corner) {
      const auto [x, y] = turned(view.centre(corner & 1 ? view.rows() : -1, corner & 2 ? view.columns() : -1));
      low[0] = std::min(low[0], x), low[1] = std::min(low[1], y);
      high[0] = std::max(high[0], x), high[1] = std::max(high[1], y);
    }
    x_ = low[0], y_ = low[1];
    rows_ = static_cast<int64_t>((high[0] - x_) / width_) + 1;
    columns_ = static_cast<int64_t>((high[1] - y_) / width_) + 1;
    if (rows_ > 4096 || columns_ > 4096) throw std::invalid_argument("width: 4096 cells a side at the most expected");
  }

  std::pair<double, double> turned(std::pair<double, double> place) const {
    return {cosine_ * place.first - sine_ * place.second, sine_ * place.first + cosine_ * place.second};
  }

  std::pair<int64_t, int64_t> cell(std::pair<double, double> place) const {
    const auto [x, y] = turned(place);
    return {static_cast<int64_t>((x - x_) / width_), static_cast<int64_t>((y - y_) / width_)};
  }

  std::pair<int64_t, int64_t> there(int64_t row, int64_t column) const {
    return reversed_ ? std::pair(rows_ - 1 - row, columns_ - 1 - column) : std::pair(row, column);
  }

  int facing(double turn) const {
    return static_cast<int>(static_cast<int64_t>((turn + turns_) * kFacings + 0.5)) & (kFacings - 1);
  }

  // Wall counts 2 for each cell near a wall that faces as it does, 1 where that is the next facing; every second row
  // and column.
  void count_cells(const place_views::PlaceView& view, int64_t directions, int64_t weight, Memory& memory) {
    const size_t size = static_cast<size_t>(plane());
    memory.near.clear();
    memory.seen.assign(size, 0);
    used_.assign(static_cast<size_t>(rows_ / kBlock + 2), {columns_, 0});
    std::vector<int> facings(directions);
    for (int64_t d = 0; d < directions; ++d)
      facings[d] = facing((static_cast<double>(d) + 0.5) / static_cast<double>(directions));
    const size_t across = static_cast<size_t>((view.columns() + 1) / 2);
    std::vector<double> along(2 * across);  // what y adds to turned coordinates
    for (size_t k = 0; k < across; ++k) {
      const double y = view.centre(0, 2 * static_cast<int64_t>(k)).second;
      along[k] = -(sine_ * y), along[across + k] = cosine_ * y;
    }
    std::vector<int32_t> found(2 * across);
    for (int64_t i = 0; i < view.rows(); i += 2) {
      const double x = view.centre(i, 0).first;
      find_cells(found.data(), along.data(), cosine_ * x, x_, width_, across);
      find_cells(found.data() + across, along.data() + across, sine_ * x, y_, width_, across);
      for (size_t k = 0; k < across; ++k) {
        const int64_t code = view.code(i, 2 * static_cast<int64_t>(k));
        if (code == directions) continue;
        const auto [i_there, j_there] = there(found[k], found[across + k]);
        const size_t place = static_cast<size_t>((i_there + kBlock) * stride() + j_there + kBlock);
        auto& [first, last] = used_[i_there / kBlock];
        first = std::min(first, j_there), last = std::max(last, j_there + kBlock);
        if (code > directions)
          count(memory.seen[place], -2 * weight);
        else
          memory.near.emplace_back(place, facings[code]);
      }
    }
    for (size_t b = used_.size() - 1; b > 0; --b)  // walls further down in their block
      used_[b] = {std::min(used_[b].first, used_[b - 1].first), std::max(used_[b].second, used_[b - 1].second)};
    worth_.resize(kFacings * size);
    for (int f = 0; f < kFacings; ++f) std::copy(memory.seen.begin(), memory.seen.end(), worth_.begin() + f * size);
    for (const auto& [place, f] : memory.near)
      for (const int aside : {-1, 0, 1})
        count(worth_[((f + aside) & (kFacings - 1)) * size + place], aside == 0 ? 2 : 1);
  }

  // Worth only falls where something was seen through, and then only rises: what is met on the way tells the most.
  void count(int16_t& worth, int64_t counts) {
    worth = static_cast<int16_t>(worth + counts);
    most_ = std::max<int32_t>(most_, std::abs(worth));
  }

  void collect_walls(const place_views::PlaceView& view, std::vector<double>& metres) {
    const size_t size = static_cast<size_t>(rows_ * columns_);
    if (metres.size() < kFacings * size) metres.resize(kFacings * size, 0.0);
    std::vector<size_t> places(view.samples());
    walls_.resize(view.samples());
    size_t count = 0;
    for (size_t k = 0; k < view.samples(); ++k) {
      const double* p = view.sample(k);
      const auto [row, column] = cell({p[0], p[1]});
      const int faces = facing(p[2]);
      const size_t place = static_cast<size_t>((row * columns_ + column) * kFacings + faces);
      const auto [i, j] = there(row, column);
      places[count] = place, walls_[count] = {static_cast<int32_t>(i), static_cast<int32_t>(j), faces, 0};
      count += metres[place] == 0 && p[3] > 0;
      metres[place] += p[3];
    }
    walls_.resize(count);
    for (size_t k = 0; k < count; ++k) {
      walls_[k].metres = static_cast<int32_t>(std::nearbyint(metres[places[k]] / kCentimetre));
      metres[places[k]] = 0;
    }
    std::sort(walls_.begin(), walls_.end(), [](const Wall& a, const Wall& b) { return a.block() < b.block(); });
  }

  double cosine_, sine_, turns_, width_, x_ = 0, y_ = 0;
  bool reversed_;
  int64_t rows_ = 0, columns_ = 0;
  int32_t most_ = 1;
  std::vector<int16_t>& worth_;
  std::vector<Wall> walls_;
  std::vector<Span> used_;
};

// What every shift of a map over another counts, which is reversed.
class Sums {
 public:
  Sums(const WideMap& reference, const WideMap& other, Memory& memory)
      : rows_(reference.rows() + other.rows() - 1), columns_(reference.columns() + other.columns() - 1),
        sum_(memory.sums), narrow_(memory.narrow) {
    sum_.assign(static_cast<size_t>(rows_ * columns_), 0);
    narrow_.assign(sum_.size() + kAtOnce + kBlock, 0);
    add(reference, other.walls());
    add(other, reference.walls());
    move_all();
  }

  int64_t columns() const { return columns_; }
  double at(int64_t place) const { return static_cast<double>(sum_[place]); }

  // Of the places that are above 0 and no lower than the eight about them the `count` highest, of equals the first.
  std::vector<int64_t> peaks(int64_t count) const {
    const auto better = [&](int64_t a, int64_t b) { return sum_[a] != sum_[b] ? sum_[a] > sum_[b] : a < b; };
    std::vector<int64_t> best;  // a heap with the worst of them at its top
    int32_t least = 0;
    for (int64_t i = 0; i < rows_ && count > 0; ++i)
      for (int64_t j = 0; j < columns_; ++j) {
        const int64_t place = i * columns_ + j;
        if (j % kAtOnce == 0 && !any_above(sum_.data() + place, std::min(kAtOnce, columns_ - j), least)) {
          j += kAtOnce - 1;  // none of these
          continue;
        }
        if (sum_[place] <= least || !is_peak(i, j)) continue;
        if (static_cast<int64_t>(best.size()) == count) {
          std::pop_heap(best.begin(), best.end(), better);
          best.pop_back();
        }
        best.push_back(place);
        std::push_heap(best.begin(), best.end(), better);
        if (static_cast<int64_t>(best.size()) == count) least = sum_[best.front()];
      }
    std::sort(best.begin(), best.end(), better);
    return best;
  }

  // Where between the cells the peak is, along rows and columns: the top of a parabola.
  std::pair<double, double> top(int64_t place) const {
    const int64_t i = place / columns_, j = place % columns_;
    const double down = i > 0 && i + 1 < rows_ ? between(place - columns_, place, place + columns_) : 0;
    const double right = j > 0 && j + 1 < columns_ ? between(place - 1, place, place + 1) : 0;
    return {static_cast<double>(i) + down, static_cast<double>(j) + right};
  }

 private:
  // What `walls` of the other map count in `map`, at their shifts.
  void add(const WideMap& map, const std::vector<Wall>& walls) {
    const int32_t most = kMost / (kTogether * map.most());
    std::vector<Wall> some;
    for (const Wall& wall : walls)
      for (int32_t left = wall.metres; left > 0; left -= most) {
        if (some.size() == kTogether || (!some.empty() && some[0].block() != wall.block())) add_block(map, some);
        some.push_back(wall);
        some.back().metres = std::min(left, most);
      }
    if (!some.empty()) add_block(map, some);
  }

  // In narrow sums, which are moved up before they could be too large.
  void add_block(const WideMap& map, std::vector<Wall>& walls) {
    int64_t row = walls[0].row, column = walls[0].column;
    int32_t added = 0;
    for (const Wall& w : walls)
      row = std::min<int64_t>(row, w.row), column = std::min<int64_t>(column, w.column), added += w.metres * map.most();
    if (held_ + added > kMost) move_all();
    held_ += added;
    walls.resize(kTogether, {walls[0].row, walls[0].column, walls[0].facing, 0});
    Group group;
    for (int k = 0; k < kTogether; ++k) group.take(k, walls[k].facing, walls[k].metres, walls[k].row - row, walls[k].column - column, map);
    add_rows(narrow_.data() + row * columns_ + column, columns_, group, map.stride(), map.used());
    touched_ = {std::min(touched_.first, row * columns_ + column),
                std::max(touched_.second, (row + group.rows) * columns_ + column + kAtOnce + kBlock)};
    walls.clear();
  }

  // What is in the narrow sums.
  void move_all() {
    const int64_t size = static_cast<int64_t>(sum_.size()), last = std::min(touched_.second, size);
    if (touched_.first < last)
      move_up(sum_.data() + touched_.first, narrow_.data() + touched_.first, static_cast<size_t>(last - touched_.first));
    touched_ = {size, 0};
    held_ = 0;
  }

  bool is_peak(int64_t i, int64_t j) const {
    const int32_t here = sum_[i * columns_ + j];
    for (int64_t r = std::max<int64_t>(i - 1, 0); r <= std::min(i + 1, rows_ - 1); ++r)
      for (int64_t c = std::max<int64_t>(j - 1, 0); c <= std::min(j + 1, columns_ - 1); ++c)
        if (sum_[r * columns_ + c] > here) return false;
    return true;
  }

  double between(int64_t before, int64_t here, int64_t after) const {
    const double bend = at(before) - 2 * at(here) + at(after);
    return bend < 0 ? (at(before) - at(after)) / (2 * bend) : 0;
  }

  int64_t rows_, columns_;
  int32_t held_ = 0;  // no narrow sum is above it
  Span touched_{int64_t{1} << 60, 0};  // the narrow sums that are not 0 are between
  std::vector<int32_t>& sum_;
  std::vector<int16_t>& narrow_;
};

inline std::pair<Out<double>, Out<double>> best_shifts(const place_views::PlaceView& reference,
                                                       const place_views::PlaceView& other, In<double, 1> turns,
                                                       double width, int64_t directions, int64_t weight,
                                                       int64_t count) {
  if (!(width > 1e-3) || directions < 1 || directions > 254 || weight < 0 || weight > 100 || count < 0)
    throw std::invalid_argument("width > 0, 1 to 254 directions, weight of 0 to 100, count >= 0 expected");
  std::vector<double> found, scores;
  for (const auto* view : {&reference, &other}) check(*view, width, weight);
  static thread_local Memory memory;
  const WideMap here(reference, 0.0, width, directions, weight, false, memory);
  // Of the cells looked at so many lie in a wide one; both ways are added up, and each counts 2.
  const double cells = width * width / (4 * reference.cell() * other.cell()), unit = kCentimetre / (4 * cells);
  for (size_t t = 0; t < turns.shape(0); ++t) {
    if (!(std::abs(turns(t)) < 7)) throw std::invalid_argument("turns: angles within a turn expected");
    const WideMap there(other, turns(t), width, directions, weight, true, memory);
    const Sums sums(here, there, memory);
    for (const int64_t place : sums.peaks(count)) {
      const auto [i, j] = sums.top(place);
      found.insert(found.end(), {here.x() - there.x() + width * (i - static_cast<double>(there.rows() - 1)),
                                 here.y() - there.y() + width * (j - static_cast<double>(there.columns() - 1)),
                                 turns(t)});
      scores.push_back(sums.at(place) * unit);
    }
  }
  memory.release();
  const size_t n = scores.size();
  return {give(std::move(found), {n, 3}), give(std::move(scores), {n})};
}

}  // namespace shifts

inline void bind_shifts(nb::module_& m) {
  m.def("best_shifts", &shifts::best_shifts, nb::arg("reference"), nb::arg("other"), nb::arg("turns"),
        nb::arg("width"), nb::arg("directions"), nb::arg("weight"), nb::arg("count"));
}
