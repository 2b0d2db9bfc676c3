// What maps say of transforms between them, by few samples and coarse cells: cheap enough for hundreds of
// candidates. The twin and the words are in matching/place_views.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace place_views {

constexpr size_t kAhead = 4;  // places before one that what it reads is fetched

// What a metre of wall counts, by what a cell says and the direction of the wall.
struct Worth {
  const double* table;
  size_t codes, directions;
  double least, most;

  explicit Worth(const In<double, 2>& given)
      : table(given.data()), codes(given.shape(0)), directions(given.shape(1)), least(0), most(0) {
    if (directions == 0) throw std::invalid_argument("table (codes, directions) expected");
    for (size_t k = 0; k < codes * directions; ++k) {
      least = std::min(least, table[k]);
      most = std::max(most, table[k]);
    }
  }
};

// The pose of a map in another one.
struct Pose {
  double x, y, theta;

  Pose inverse() const {
    const double c = std::cos(theta), s = std::sin(theta);
    return {-c * x - s * y, s * x - c * y, -theta};
  }
};

class PlaceView {
 public:
  PlaceView() : rows_(0), columns_(0), origin_{0, 0}, cell_(1) {}
  // codes (rows, columns): what a cell says. Of samples: x, y, direction in turns, metres of wall.
  PlaceView(In<uint8_t, 2> codes, In<double, 1> origin, double cell, In<double, 2> points, In<double, 1> facing,
            In<double, 1> metres)
      : rows_(codes.shape(0)),
        columns_(codes.shape(1)),
        codes_(codes.data(), codes.data() + rows_ * columns_),
        cell_(cell) {
    const size_t n = points.shape(0);
    if (origin.shape(0) != 2 || points.shape(1) != 2 || facing.shape(0) != n || metres.shape(0) != n || !(cell > 1e-3))
      throw std::invalid_argument("origin (2,), points (n, 2), facing, metres (n,), cell above 0 expected");
    origin_[0] = origin(0), origin_[1] = origin(1);
    samples_.reserve(4 * n);
    for (size_t k = 0; k < n; ++k)
      samples_.insert(samples_.end(), {points(k, 0), points(k, 1), facing(k), metres(k)});
  }

  // The same map as a sensor has it that hangs upside down: y is -y. Its cells tell so many directions apart.
  PlaceView mirrored(int64_t directions) const {
    PlaceView view = *this;
    view.origin_[1] = -origin_[1] - cell_ * static_cast<double>(columns_);
    for (size_t i = 0; i < rows_; ++i)
      for (size_t j = 0; j < columns_; ++j) {
        const int64_t code = codes_[i * columns_ + columns_ - 1 - j];
        view.codes_[i * columns_ + j] = static_cast<uint8_t>(code < directions ? directions - 1 - code : code);
      }
    for (size_t k = 0; k < view.samples_.size(); k += 4) {
      double* sample = view.samples_.data() + k;
      sample[1] = -sample[1];
      sample[2] = -sample[2] - std::floor(-sample[2]);
    }
    return view;
  }

  // What the walls of `other`, every `stride`th sample, count in this map, at the pose of it.
  double worth(const PlaceView& other, const Pose& pose, size_t stride, const Worth& said) const {
    const double turn = pose.theta / 6.283185307179586476925286766559 + 2;
    double sum = 0;
    each_cell(other, pose, stride, [&](const double* p, const uint8_t& cell) {
      const size_t code = cell;
      size_t facing = static_cast<size_t>((p[2] + turn) * static_cast<double>(said.directions));
      while (facing >= said.directions) facing -= said.directions;  // thrice at most: sooner done than a division
      if (code < said.codes) sum += p[3] * said.table[code * said.directions + facing];
    });
    return sum;
  }

  // What the walls of this map, every `stride`th sample, count at the most, wherever they lie: no sum is above it.
  double most(size_t stride, const Worth& said) const {
    double sum = 0;
    for (size_t k = 0; k < samples_.size(); k += 4 * stride)
      sum += std::max(samples_[k + 3] * said.most, samples_[k + 3] * said.least);
    return sum;
  }

  // Fetch what will be read: of thousands of maps, most are far away.
  void fetch_samples(size_t stride) const {
    for (size_t k = 0; k < samples_.size(); k += 4 * stride) __builtin_prefetch(samples_.data() + k);
  }
  void fetch_cells(const PlaceView& other, const Pose& pose, size_t stride) const {
    each_cell(other, pose, stride, [](const double*, const uint8_t& cell) { __builtin_prefetch(&cell); });
  }

  int64_t rows() const { return static_cast<int64_t>(rows_); }
  int64_t columns() const { return static_cast<int64_t>(columns_); }
  double cell() const { return cell_; }
  uint8_t code(int64_t row, int64_t column) const { return codes_[row * columns() + column]; }
  // [m], of a cell, which need not be there.
  std::pair<double, double> centre(int64_t row, int64_t column) const {
    return {origin_[0] + (static_cast<double>(row) + 0.5) * cell_,
            origin_[1] + (static_cast<double>(column) + 0.5) * cell_};
  }
  bool holds(double x, double y) const {
    const double row = (x - origin_[0]) / cell_, column = (y - origin_[1]) / cell_;
    return row >= 0 && column >= 0 && row <= static_cast<double>(rows_) && column <= static_cast<double>(columns_);
  }
  size_t samples() const { return samples_.size() / 4; }
  const double* sample(size_t k) const { return samples_.data() + 4 * k; }

 private:
  // Calls `seen` with every `stride`th sample of `other` that lies in this map, and the cell that it lies in.
  template <typename Seen>
  void each_cell(const PlaceView& other, const Pose& pose, size_t stride, Seen seen) const {
    const double c = std::cos(pose.theta), s = std::sin(pose.theta);
    const double rows = static_cast<double>(rows_), columns = static_cast<double>(columns_);
    for (size_t k = 0; k < other.samples_.size(); k += 4 * stride) {
      const double* p = other.samples_.data() + k;
      const double row = (c * p[0] - s * p[1] + pose.x - origin_[0]) / cell_;
      const double column = (s * p[0] + c * p[1] + pose.y - origin_[1]) / cell_;
      if (!(row >= 0 && column >= 0 && row < rows && column < columns)) continue;
      seen(p, codes_[static_cast<size_t>(row) * columns_ + static_cast<size_t>(column)]);
    }
  }

  size_t rows_, columns_;
  std::vector<uint8_t> codes_;
  double origin_[2], cell_;
  std::vector<double> samples_;
};

// The views of many maps by slot: among thousands of places, what is worth a closer look is told here.
class PlaceViews {
 public:
  // Takes the view of one more map; returns its slot.
  int64_t add(const PlaceView& view) {
    views_.push_back(view);
    alive_.push_back(true);
    return static_cast<int64_t>(views_.size()) - 1;
  }

  // Forgets a view; its slot is not given again.
  void remove(int64_t slot) {
    check(slot);
    views_[slot] = PlaceView();
    alive_[slot] = false;
  }

  // Which places, by number, both maps say most of, at most `count`, and what they say: of the `kept` that are the
  // best by every `stride`th sample.
  std::pair<Out<int64_t>, Out<double>> best(const PlaceView& other, In<int64_t, 1> slots, In<double, 2> transforms,
                                            In<double, 2> table, int64_t stride, int64_t kept, int64_t count) const {
    if (transforms.shape(0) != slots.shape(0) || transforms.shape(1) != 3 || stride < 1 || kept < 0 || count < 0)
      throw std::invalid_argument("transforms (n, 3) of n slots, stride >= 1, kept and count >= 0 expected");
    places_.clear();
    for (size_t k = 0; k < slots.shape(0); ++k) {
      check(slots(k));
      const Pose pose{transforms(k, 0), transforms(k, 1), transforms(k, 2)};
      if (!(std::isfinite(pose.x) && std::isfinite(pose.y) && std::abs(pose.theta) < 7))
        throw std::invalid_argument("transforms: finite numbers, angles within a turn expected");
      places_.push_back({&views_[slots(k)], pose, static_cast<int64_t>(k), 0});
    }
    const Worth said(table);
    look_roughly(other, said, static_cast<size_t>(stride), static_cast<size_t>(kept));
    for (Place& place : places_) {
      const double there = place.view->worth(other, place.pose, 1, said);
      place.score = (there + other.worth(*place.view, place.pose.inverse(), 1, said)) / 2;
    }
    // Of equals the one that was better roughly.
    std::stable_sort(places_.begin(), places_.end(), [](const Place& a, const Place& b) { return a.score > b.score; });
    const size_t n = std::min(places_.size(), static_cast<size_t>(count));
    std::vector<int64_t> numbers;
    std::vector<double> scores;
    for (size_t k = 0; k < n; ++k) numbers.push_back(places_[k].number), scores.push_back(places_[k].score);
    return {give(std::move(numbers), {n}), give(std::move(scores), {n})};
  }

 private:
  struct Place {
    const PlaceView* view;
    Pose pose;
    int64_t number;
    double score;
  };

  static bool better(const Place& a, const Place& b) {
    return a.score != b.score ? a.score > b.score : a.number < b.number;
  }

  void check(int64_t slot) const {
    if (slot < 0 || slot >= static_cast<int64_t>(views_.size()) || !alive_[slot])
      throw std::invalid_argument("slot: of a map expected");
  }

  // Leaves the `kept` best places, in order. What their walls say in our map is looked up first, which lies near;
  // ours are looked up in theirs only where that can still bring a place among the best.
  void look_roughly(const PlaceView& other, const Worth& said, size_t stride, size_t kept) const {
    for (size_t k = 0; k < places_.size(); ++k) {
      if (k + 2 * kAhead < places_.size()) __builtin_prefetch(places_[k + 2 * kAhead].view);
      if (k + kAhead < places_.size()) places_[k + kAhead].view->fetch_samples(stride);
      places_[k].score = other.worth(*places_[k].view, places_[k].pose.inverse(), stride, said);
    }
    std::sort(places_.begin(), places_.end(), better);
    const double most = other.most(stride, said);
    size_t best = 0;  // of the places looked at, a heap with the least of them first
    for (size_t k = 0; k < places_.size() && kept > 0; ++k) {
      Place place = places_[k];
      const auto of_both = [&](double there) { return static_cast<double>(stride) * (there + place.score) / 2; };
      if (best == kept && of_both(most) < places_.front().score) break;
      if (const size_t n = k + kAhead; n < places_.size()) places_[n].view->fetch_cells(other, places_[n].pose, stride);
      place.score = of_both(place.view->worth(other, place.pose, stride, said));
      if (best == kept) {
        if (!better(place, places_.front())) continue;
        std::pop_heap(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(best--), better);
      }
      places_[best++] = place;
      std::push_heap(places_.begin(), places_.begin() + static_cast<std::ptrdiff_t>(best), better);
    }
    places_.resize(best);
    std::sort_heap(places_.begin(), places_.end(), better);
  }

  std::vector<PlaceView> views_;
  std::vector<uint8_t> alive_;
  mutable std::vector<Place> places_;  // of the last query: its room is used again
};

}  // namespace place_views

inline void bind_place_views(nb::module_& m) {
  using namespace place_views;
  nb::class_<PlaceView>(m, "PlaceView")
      .def(nb::init<In<uint8_t, 2>, In<double, 1>, double, In<double, 2>, In<double, 1>, In<double, 1>>(),
           nb::arg("codes"), nb::arg("origin"), nb::arg("cell"), nb::arg("points"), nb::arg("facing"),
           nb::arg("metres"))
      .def("mirrored", &PlaceView::mirrored, nb::arg("directions"));
  nb::class_<PlaceViews>(m, "PlaceViews")
      .def(nb::init<>())
      .def("add", &PlaceViews::add, nb::arg("view"))
      .def("remove", &PlaceViews::remove, nb::arg("slot"))
      .def("best", &PlaceViews::best, nb::arg("other"), nb::arg("slots"), nb::arg("transforms"), nb::arg("table"),
           nb::arg("stride"), nb::arg("kept"), nb::arg("count"));
}
