// How many times wall is drawn. The twin and the words are in matching/density.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "arrays.hpp"
#include "grid.hpp"

namespace density {

// The bits from `first` on, before `last`, of 64.
inline uint64_t bits(int64_t first, int64_t last) {
  const int64_t count = last - first;
  return count <= 0 ? 0 : (count >= 64 ? ~uint64_t{0} : ((uint64_t{1} << count) - 1) << first);
}

inline int64_t place(double along, double radius) {
  return static_cast<int64_t>(std::clamp((along / radius + 1) * 32, 0.0, 64.0));
}

inline int64_t count_bits(uint64_t word) {
  word -= (word >> 1) & 0x5555555555555555;
  word = (word & 0x3333333333333333) + ((word >> 2) & 0x3333333333333333);
  word = (word + (word >> 4)) & 0x0f0f0f0f0f0f0f0f;
  return static_cast<int64_t>((word * 0x0101010101010101) >> 56);
}

inline Out<double> times_drawn(In<double, 2> points, In<double, 2> normals, In<double, 1> length, double radius,
                               double min_cosine) {
  const size_t n = points.shape(0);
  if (points.shape(1) != 2 || normals.shape(0) != n || normals.shape(1) != 2 || length.shape(0) != n || !(radius > 0))
    throw std::invalid_argument("points, normals (n, 2), length (n,), radius > 0 expected");
  const Grid grid(points.data(), n, radius);
  std::vector<double> times(n);
  for (size_t i = 0; i < n; ++i) {
    uint64_t covered = 0;
    int64_t drawn = 0;
    const auto add = [&](int64_t k) {
      const double dx = points(k, 0) - points(i, 0), dy = points(k, 1) - points(i, 1);
      const double cosine = normals(k, 0) * normals(i, 0) + normals(k, 1) * normals(i, 1);
      if (!(dx * dx + dy * dy <= radius * radius && cosine > min_cosine)) return;
      const double along = dx * normals(i, 1) - dy * normals(i, 0), half = length(k) / 2;
      const uint64_t part = bits(place(along - half, radius), place(along + half, radius));
      covered |= part, drawn += count_bits(part);
    };
    // Cells are as wide as the radius, or wider: what is near is in these nine.
    for (int64_t ring = 0; ring < 2; ++ring) grid.around(points(i, 0), points(i, 1), ring, add);
    times[i] = covered ? static_cast<double>(drawn) / static_cast<double>(count_bits(covered)) : 1.0;
  }
  return give(std::move(times), {n});
}

}  // namespace density

inline void bind_density(nb::module_& m) {
  m.def("times_drawn", &density::times_drawn, nb::arg("points"), nb::arg("normals"), nb::arg("length"),
        nb::arg("radius"), nb::arg("min_cosine"));
}
