// ICP of many starts in a raster. The twin and the words are in matching/raster_icp.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "judging.hpp"
#include "motions.hpp"

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

// Some samples about their middle, so that turning and shifting do not hinder each other.
struct Moving {
  std::vector<double> points, normals;
  double x = 0, y = 0;

  // So many of them at the most.
  Moving(In<double, 2> all, In<double, 2> facing, size_t most) {
    const size_t n = all.shape(0), stride = n > most ? 1 + (n - 1) / most : 1;
    for (size_t k = 0; k < n; k += stride) {
      points.insert(points.end(), {all(k, 0), all(k, 1)});
      normals.insert(normals.end(), {facing(k, 0), facing(k, 1)});
      x += all(k, 0), y += all(k, 1);
    }
    const double count = static_cast<double>(std::max<size_t>(size(), 1));
    x /= count, y /= count;
    for (size_t k = 0; k < points.size(); k += 2) points[k] -= x, points[k + 1] -= y;
  }

  size_t size() const { return points.size() / 2; }
};

// The same motion of coordinates less (x, y).
inline void about(double* pose, double x, double y) {
  const double c = std::cos(pose[2]), s = std::sin(pose[2]);
  pose[0] = pose[0] + c * x - s * y, pose[1] = pose[1] + s * x + c * y, pose[2] = motions::wrap(pose[2]);
}

inline Out<double> align_on_raster(In<double, 2> points, In<double, 2> normals, int64_t most, In<double, 2> poses,
                                   In<double, 1> scales, In<double, 2> walls, In<double, 2> facing,
                                   In<int32_t, 2> nearest, In<double, 1> origin, double cell, double min_cosine,
                                   double held) {
  check_oriented(points, normals);
  check_oriented(walls, facing);
  if (poses.shape(1) != 3 || !(held > 0) || most < 1)
    throw std::invalid_argument("poses (k, 3), most >= 1, held > 0 expected");
  const Cells cells = cells_of(nearest, origin, cell, walls.shape(0));
  const Moving moving(points, normals, static_cast<size_t>(most));
  const double damping = held * static_cast<double>(std::max<size_t>(moving.size(), 1));
  std::vector<double> moved(poses.data(), poses.data() + poses.size());
  for (size_t p = 0; p < poses.shape(0); ++p) {
    double* pose = moved.data() + 3 * p;
    about(pose, moving.x, moving.y);
    for (size_t round = 0; round < scales.shape(0); ++round) {
      const double scale = scales(round), reach = 9 * scale * scale, c = std::cos(pose[2]), s = std::sin(pose[2]);
      std::array<double, 6> a{damping, 0, 0, damping, 0, damping};
      std::array<double, 3> g{};
      for (size_t k = 0; k < moving.points.size(); k += 2) {
        const double *q = moving.points.data() + k, *m = moving.normals.data() + k;
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
    about(pose, -moving.x, -moving.y);
  }
  return give(std::move(moved), {poses.shape(0), 3});
}

}  // namespace raster_icp

inline void bind_raster_icp(nb::module_& m) {
  m.def("align_on_raster", &raster_icp::align_on_raster, nb::arg("points"), nb::arg("normals"), nb::arg("most"),
        nb::arg("poses"), nb::arg("scales"), nb::arg("walls"), nb::arg("facing"), nb::arg("nearest"),
        nb::arg("origin"), nb::arg("cell"), nb::arg("min_cosine"), nb::arg("held"));
}
