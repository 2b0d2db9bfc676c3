// What stands free and is short. The twin and the words are in matching/standing.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace standing {

constexpr int kTurns = 30;  // of the rectangles tried: 3° each
constexpr double kTurn = 3.14159265358979323846 / 60;

// Numbers the cells that hang together with those of samples: cells within `reach` of a wall that touch.
class Things {
 public:
  Things(In<float, 2> distance, double reach)
      : rows_(static_cast<int64_t>(distance.shape(0))), columns_(static_cast<int64_t>(distance.shape(1))),
        distance_(distance.data()), reach_(static_cast<float>(reach)), label_(static_cast<size_t>(rows_ * columns_), 0) {}

  int64_t count() const { return count_; }

  // The thing, from 0, that has the cell in row `i`, column `j`.
  int64_t at(int64_t i, int64_t j) {
    const int64_t cell = i * columns_ + j;
    if (label_[cell] == 0) spread(cell);
    return label_[cell] - 1;
  }

 private:
  void spread(int64_t start) {
    label_[start] = static_cast<int32_t>(++count_);
    open_.assign(1, start);
    while (!open_.empty()) {
      const int64_t i = open_.back() / columns_, j = open_.back() % columns_;
      open_.pop_back();
      for (int64_t r = std::max<int64_t>(i - 1, 0); r <= std::min(i + 1, rows_ - 1); ++r)
        for (int64_t c = std::max<int64_t>(j - 1, 0); c <= std::min(j + 1, columns_ - 1); ++c) {
          const int64_t cell = r * columns_ + c;
          if (label_[cell] != 0 || !(distance_[cell] <= reach_)) continue;
          label_[cell] = static_cast<int32_t>(count_);
          open_.push_back(cell);
        }
    }
  }

  int64_t rows_, columns_, count_ = 0;
  const float* distance_;
  float reach_;  // as precise as distances are: some are as far
  std::vector<int32_t> label_;
  std::vector<int64_t> open_;
};

struct Extent {
  double low[2] = {1e300, 1e300}, high[2] = {-1e300, -1e300};

  void add(double x, double y) {
    low[0] = std::min(low[0], x), low[1] = std::min(low[1], y);
    high[0] = std::max(high[0], x), high[1] = std::max(high[1], y);
  }
  double wide() const { return high[0] - low[0]; }
  double tall() const { return high[1] - low[1]; }
};

// Cosines and sines of the turns.
inline const std::vector<std::pair<double, double>>& turns() {
  static const std::vector<std::pair<double, double>> made = [] {
    std::vector<std::pair<double, double>> all;
    for (int turn = 0; turn < kTurns; ++turn) all.emplace_back(std::cos(turn * kTurn), std::sin(turn * kTurn));
    return all;
  }();
  return made;
}

// [m] the longer side of the least rectangle around some points.
inline double longer_side(const std::vector<std::pair<double, double>>& points) {
  double least = 1e300, longer = 0;
  for (const auto& [c, s] : turns()) {
    Extent extent;
    for (const auto& [x, y] : points) extent.add(x * c + y * s, y * c - x * s);
    const double area = extent.wide() * extent.tall();
    if (area < least) least = area, longer = std::max(extent.wide(), extent.tall());
  }
  return longer;
}

inline Out<uint8_t> standing_free(In<double, 2> points, In<double, 1> origin, double cell, In<float, 2> distance,
                                  double reach, double max_side) {
  const size_t n = points.shape(0);
  if (points.shape(1) != 2 || origin.shape(0) != 2 || !(cell > 0))
    throw std::invalid_argument("points (n, 2), origin (2,), cell > 0 expected");
  Things things(distance, reach);
  std::vector<int64_t> thing(n);
  for (size_t k = 0; k < n; ++k) {
    const double i = std::floor((points(k, 0) - origin(0)) / cell), j = std::floor((points(k, 1) - origin(1)) / cell);
    if (!(i >= 0 && j >= 0 && i < static_cast<double>(distance.shape(0)) && j < static_cast<double>(distance.shape(1))))
      throw std::invalid_argument("points: inside of the raster expected");
    thing[k] = things.at(static_cast<int64_t>(i), static_cast<int64_t>(j));
  }
  std::vector<Extent> upright(things.count());
  for (size_t k = 0; k < n; ++k) upright[thing[k]].add(points(k, 0), points(k, 1));
  std::vector<std::vector<std::pair<double, double>>> members(things.count());
  const double most = std::sqrt(2.0) * max_side;  // whatever its turn
  const auto may_be = [&](int64_t t) { return std::max(upright[t].wide(), upright[t].tall()) <= most; };
  for (size_t k = 0; k < n; ++k)
    if (may_be(thing[k])) members[thing[k]].emplace_back(points(k, 0), points(k, 1));
  std::vector<uint8_t> is_short(things.count()), found(n);
  for (int64_t t = 0; t < things.count(); ++t) is_short[t] = may_be(t) && longer_side(members[t]) <= max_side;
  for (size_t k = 0; k < n; ++k) found[k] = is_short[thing[k]];
  return give(std::move(found), {n});
}

}  // namespace standing

inline void bind_standing(nb::module_& m) {
  m.def("standing_free", &standing::standing_free, nb::arg("points"), nb::arg("origin"), nb::arg("cell"),
        nb::arg("distance"), nb::arg("reach"), nb::arg("max_side"));
}
