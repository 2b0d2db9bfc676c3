// How far places are from the nearest of some points. The twin and the words are in matching/nearness.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "arrays.hpp"

namespace nearness {

constexpr size_t kTogether = 16;  // points that are left out at once where all of them are too far

struct Box {
  double low[2], high[2];

  Box(const double* points, size_t count) : low{points[0], points[1]}, high{points[0], points[1]} {
    for (size_t i = 1; i < count; ++i)
      for (int k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], points[2 * i + k]);
        high[k] = std::max(high[k], points[2 * i + k]);
      }
  }
  double squared(double x, double y) const {
    const double dx = std::max({low[0] - x, x - high[0], 0.0}), dy = std::max({low[1] - y, y - high[1], 0.0});
    return dx * dx + dy * dy;
  }
};

inline Out<double> nearest_distances(In<double, 2> points, In<double, 2> places) {
  const size_t n = points.shape(0), m = places.shape(0);
  if (points.shape(1) != 2 || places.shape(1) != 2) throw std::invalid_argument("points, places (n, 2) expected");
  std::vector<Box> boxes;
  for (size_t i = 0; i < n; i += kTogether) boxes.emplace_back(points.data() + 2 * i, std::min(kTogether, n - i));
  std::vector<double> distance(m, std::numeric_limits<double>::infinity());
  size_t last = 0;  // the box of the nearest point: the next place is often near it
  for (size_t k = 0; k < m; ++k) {
    const double x = places(k, 0), y = places(k, 1);
    double least = std::numeric_limits<double>::infinity();
    const auto look = [&](size_t b) {
      if (!(boxes[b].squared(x, y) < least)) return;
      for (size_t i = b * kTogether; i < std::min(n, (b + 1) * kTogether); ++i) {
        const double dx = points(i, 0) - x, dy = points(i, 1) - y, squared = dx * dx + dy * dy;
        if (squared < least) least = squared, last = b;
      }
    };
    if (n > 0) look(last);
    for (size_t b = 0; b < boxes.size(); ++b) look(b);
    distance[k] = std::sqrt(least);
  }
  return give(std::move(distance), {m});
}

}  // namespace nearness

inline void bind_nearness(nb::module_& m) {
  m.def("nearest_distances", &nearness::nearest_distances, nb::arg("points"), nb::arg("places"));
}
