// ICP of many starts in a raster. The twin and the words are in matching/raster_icp.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "judging.hpp"

namespace raster_icp {

using judging::Cells;
using judging::check_oriented;

inline Cells cells_of(In<int32_t, 2> nearest, In<double, 1> origin, double cell, size_t samples) {
  if (origin.shape(0) != 2 || !(cell > 0) || nearest.shape(0) < 1 || nearest.shape(1) < 1)
    throw std::invalid_argument("origin (2,), cell > 0, nearest (rows, columns) of one at least expected");
  int32_t least = 0, most = 0;  // without a way out: many cells are looked at together
  for (size_t k = 0; k < nearest.size(); ++k)
    least = std::min(least, nearest.data()[k]), most = std::max(most, nearest.data()[k]);
  if (least < 0 || most >= static_cast<int64_t>(samples))
    throw std::invalid_argument("nearest: numbers of samples expected");
  return {origin(0), origin(1), cell, static_cast<int64_t>(nearest.shape(0)),
          static_cast<int64_t>(nearest.shape(1))};
}

// Solves a symmetric positive definite system by Cholesky's factors.
inline std::array<double, 3> solve(const std::array<double, 6>& a, const std::array<double, 3>& b) {
  const double l00 = std::sqrt(a[0]), l10 = a[1] / l00, l20 = a[2] / l00;
  const double l11 = std::sqrt(a[3] - l10 * l10), l21 = (a[4] - l20 * l10) / l11;
  const double l22 = std::sqrt(a[5] - l20 * l20 - l21 * l21);
  const double y0 = b[0] / l00, y1 = (b[1] - l10 * y0) / l11, y2 = (b[2] - l20 * y0 - l21 * y1) / l22;
  const double z2 = y2 / l22, z1 = (y1 - l21 * z2) / l11;
  return {(y0 - l10 * z1 - l20 * z2) / l00, z1, z2};
}

inline Out<double> align_on_raster(In<double, 2> points, In<double, 2> normals, In<double, 2> poses,
                                   In<double, 1> scales, In<double, 2> walls, In<double, 2> facing,
                                   In<int32_t, 2> nearest, In<double, 1> origin, double cell, double min_cosine,
                                   double damping) {
  check_oriented(points, normals);
  check_oriented(walls, facing);
  if (poses.shape(1) != 3 || !(damping > 0)) throw std::invalid_argument("poses (k, 3), damping > 0 expected");
  const Cells cells = cells_of(nearest, origin, cell, walls.shape(0));
  std::vector<double> moved(poses.data(), poses.data() + poses.size());
  for (size_t p = 0; p < poses.shape(0); ++p) {
    double* pose = moved.data() + 3 * p;
    for (size_t round = 0; round < scales.shape(0); ++round) {
      const double scale = scales(round), reach = 9 * scale * scale, c = std::cos(pose[2]), s = std::sin(pose[2]);
      std::array<double, 6> a{damping, 0, 0, damping, 0, damping};
      std::array<double, 3> g{};
      for (size_t k = 0; k < points.shape(0); ++k) {
        const double *q = points.data() + 2 * k, *m = normals.data() + 2 * k;
        const double ax = c * q[0] - s * q[1], ay = s * q[0] + c * q[1];
        const int64_t at = cells.at(ax + pose[0], ay + pose[1]);
        if (at < 0) continue;
        const int32_t wall = nearest.data()[at];
        const double *w = walls.data() + 2 * wall, *n = facing.data() + 2 * wall;
        const double dx = ax + pose[0] - w[0], dy = ay + pose[1] - w[1], squared = dx * dx + dy * dy;
        if (squared > reach) continue;
        if ((c * m[0] - s * m[1]) * n[0] + (s * m[0] + c * m[1]) * n[1] < min_cosine) continue;
        const double share = 1 + squared / (scale * scale), weight = 1 / (share * share);
        const double residual = n[0] * dx + n[1] * dy, lever = n[1] * ax - n[0] * ay;
        a[0] += weight * n[0] * n[0];
        a[1] += weight * n[0] * n[1];
        a[2] += weight * n[0] * lever;
        a[3] += weight * n[1] * n[1];
        a[4] += weight * n[1] * lever;
        a[5] += weight * lever * lever;
        g[0] += weight * n[0] * residual;
        g[1] += weight * n[1] * residual;
        g[2] += weight * lever * residual;
      }
      const auto step = solve(a, g);
      for (int d = 0; d < 3; ++d) pose[d] -= step[d];
    }
  }
  return give(std::move(moved), {poses.shape(0), 3});
}

}  // namespace raster_icp

inline void bind_raster_icp(nb::module_& m) {
  m.def("align_on_raster", &raster_icp::align_on_raster, nb::arg("points"), nb::arg("normals"), nb::arg("poses"),
        nb::arg("scales"), nb::arg("walls"), nb::arg("facing"), nb::arg("nearest"), nb::arg("origin"),
        nb::arg("cell"), nb::arg("min_cosine"), nb::arg("damping"));
}
