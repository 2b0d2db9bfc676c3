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

// A sample of wall: where it is and faces, and half of what it stands for.
struct Drawn {
  double x, y, u, v, half;
};

// Of n samples, of which `points` and `normals` hold two numbers each.
inline std::vector<double> times_drawn(const std::vector<double>& points, const std::vector<double>& normals,
                                       const std::vector<double>& length, double radius, double min_cosine) {
  const size_t n = length.size();
  const Grid grid(points.data(), n, radius);
  std::vector<Drawn> drawn_by;  // cell by cell: what is near lies together
  drawn_by.reserve(n);
  for (const int64_t k : grid.order())
    drawn_by.push_back({points[2 * k], points[2 * k + 1], normals[2 * k], normals[2 * k + 1], length[k] / 2});
  std::vector<double> times(n);
  for (size_t i = 0; i < n; ++i) {
    const Drawn here = drawn_by[i];
    uint64_t covered = 0;
    int64_t drawn = 0;
    // Cells are as wide as the radius, or wider: what is near is in these nine.
    grid.beside(here.x, here.y, [&](int64_t first, int64_t last) {
      for (int64_t k = first; k < last; ++k) {
        const Drawn& there = drawn_by[static_cast<size_t>(k)];
        const double dx = there.x - here.x, dy = there.y - here.y;
        const double cosine = there.u * here.u + there.v * here.v;
        if (!(dx * dx + dy * dy <= radius * radius && cosine > min_cosine)) continue;
        const double along = dx * here.v - dy * here.u;
        const uint64_t part = bits(place(along - there.half, radius), place(along + there.half, radius));
        covered |= part, drawn += count_bits(part);
      }
    });
    times[grid.order()[i]] = covered ? static_cast<double>(drawn) / static_cast<double>(count_bits(covered)) : 1.0;
  }
  return times;
}

}  // namespace density
