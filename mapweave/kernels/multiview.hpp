// Multi-view ICP: normal equations of all scans of a submap. The twin and the words are in multiview.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "grid.hpp"

namespace multiview {

struct Known {
  double x, y, nx, ny;
  int64_t owner;  // -1: it stays
};

using Partner = std::pair<double, int64_t>;  // squared distance, number

// The nearest `count` of `known` within `reach`, of place and normal, nearest first.
inline void nearest(const std::vector<Known>& known, const Grid& grid, const Known& point, double normal_weight,
                    size_t count, double reach, std::vector<Partner>& found) {
  found.clear();
  double bound = reach * reach;
  for (int64_t ring = 0;; ++ring) {
    const double apart = grid.around(point.x, point.y, ring, [&](int64_t number) {
      const Known& k = known[number];
      const double dx = k.x - point.x, dy = k.y - point.y;
      double squared = dx * dx + dy * dy;
      if (squared > bound) return;
      const double du = normal_weight * (k.nx - point.nx), dv = normal_weight * (k.ny - point.ny);
      squared += du * du + dv * dv;
      if (!(squared < reach * reach)) return;
      const Partner next{squared, number};
      if (found.size() == count && !(next < found.back())) return;
      if (found.size() == count) found.pop_back();
      found.insert(std::upper_bound(found.begin(), found.end(), next), next);
      if (found.size() == count) bound = found.back().first;
    });
    // What is in the next ring is at least a cell farther than the last one's least.
    const double next = apart + grid.cell();
    if (next > 0 && next * next > bound) return;
  }
}

inline auto normal_equations(In<double, 2> points, In<double, 2> normals, In<int64_t, 1> owner,
                                  In<double, 2> poses, In<double, 2> walls, In<double, 2> wall_normals,
                                  double normal_weight, int64_t partners, double scale) {
  const size_t m = points.shape(0), n = poses.shape(0), w = walls.shape(0);
  if (points.shape(1) != 2 || normals.shape(0) != m || normals.shape(1) != 2 || owner.shape(0) != m ||
      poses.shape(1) != 3 || walls.shape(1) != 2 || wall_normals.shape(0) != w || wall_normals.shape(1) != 2)
    throw std::invalid_argument("points, normals (m, 2), owner (m,), poses (n, 3), walls (w, 2) expected");
  if (!(scale > 0) || partners < 1) throw std::invalid_argument("scale, partners: above 0 expected");
  std::vector<Known> known(m + w);
  std::vector<double> places(2 * (m + w));
  std::vector<double> cosine(n), sine(n);
  for (size_t k = 0; k < n; ++k) cosine[k] = std::cos(poses.data()[3 * k + 2]), sine[k] = std::sin(poses.data()[3 * k + 2]);
  for (size_t i = 0; i < m; ++i) {
    const int64_t a = owner.data()[i];
    if (a < 0 || a >= static_cast<int64_t>(n)) throw std::invalid_argument("owner: numbers of poses expected");
    const double *p = points.data() + 2 * i, *q = normals.data() + 2 * i, c = cosine[a], s = sine[a];
    known[i] = {c * p[0] - s * p[1] + poses.data()[3 * a], s * p[0] + c * p[1] + poses.data()[3 * a + 1],
                c * q[0] - s * q[1], s * q[0] + c * q[1], a};
  }
  for (size_t i = 0; i < w; ++i)
    known[m + i] = {walls.data()[2 * i], walls.data()[2 * i + 1], wall_normals.data()[2 * i], wall_normals.data()[2 * i + 1], -1};
  for (size_t i = 0; i < m + w; ++i) places[2 * i] = known[i].x, places[2 * i + 1] = known[i].y;
  const Grid grid(places.data(), m + w, 0.15);
  const size_t size = 3 * n;
  std::vector<double> matrix(size * size, 0.0), pull(size, 0.0);
  std::vector<Partner> found;
  for (size_t i = 0; i < m; ++i) {
    const Known& point = known[i];
    nearest(known, grid, point, normal_weight, static_cast<size_t>(partners) + 1, 3 * scale, found);
    double total = 0;
    for (auto& [squared, number] : found) {
      const double ratio = 1 + squared / (scale * scale);
      squared = known[number].owner == point.owner ? 0.0 : 1 / (ratio * ratio);  // Geman-McClure
      total += squared;
    }
    total = std::max(total, 1.0);  // however many partners a point has, it was seen once
    for (const auto& [share, number] : found) {
      const Known& partner = known[number];
      if (partner.owner == point.owner) continue;
      const double weight = share / total;
      const double residual = partner.nx * (point.x - partner.x) + partner.ny * (point.y - partner.y);
      const int64_t ends[2] = {point.owner, partner.owner};
      double row[2][3];
      for (int e = 0; e < 2; ++e) {
        if (ends[e] < 0) continue;
        const double* pose = poses.data() + 3 * ends[e];
        const double sign = e == 0 ? 1 : -1;
        row[e][0] = sign * partner.nx, row[e][1] = sign * partner.ny;
        row[e][2] = sign * (partner.ny * (point.x - pose[0]) - partner.nx * (point.y - pose[1]));
      }
      for (int e = 0; e < 2; ++e) {
        if (ends[e] < 0) continue;
        for (int r = 0; r < 3; ++r) pull[3 * ends[e] + r] += weight * residual * row[e][r];
        for (int f = 0; f < 2; ++f) {
          if (ends[f] < 0) continue;
          double* block = matrix.data() + 3 * ends[e] * static_cast<int64_t>(size) + 3 * ends[f];
          for (int r = 0; r < 3; ++r)
            for (int c = 0; c < 3; ++c) block[r * size + c] += weight * row[e][r] * row[f][c];
        }
      }
    }
  }
  return std::make_tuple(give(std::move(matrix), {size, size}), give(std::move(pull), {size}));
}

// Cholesky's factorisation of a symmetric, positive definite matrix, row by row.
inline Out<double> solve_positive(In<double, 2> matrix, In<double, 1> right) {
  const size_t n = right.shape(0);
  if (matrix.shape(0) != n || matrix.shape(1) != n) throw std::invalid_argument("matrix (n, n), right (n,) expected");
  std::vector<double> upper(matrix.data(), matrix.data() + n * n), x(right.data(), right.data() + n);
  for (size_t k = 0; k < n; ++k) {
    double* row = upper.data() + k * n;
    if (!(row[k] > 0)) throw std::invalid_argument("matrix: a positive definite one expected");
    const double by = 1 / std::sqrt(row[k]);
    for (size_t j = k; j < n; ++j) row[j] *= by;
    x[k] *= by;
    for (size_t i = k + 1; i < n; ++i) {
      const double share = row[i];
      if (share == 0) continue;
      double* below = upper.data() + i * n;
      for (size_t j = i; j < n; ++j) below[j] -= share * row[j];
      x[i] -= share * x[k];
    }
  }
  for (size_t k = n; k-- > 0;) {
    const double* row = upper.data() + k * n;
    for (size_t j = k + 1; j < n; ++j) x[k] -= row[j] * x[j];
    x[k] /= row[k];
  }
  return give(std::move(x), {n});
}

}  // namespace multiview

inline void bind_multiview(nb::module_& m) {
  m.def("normal_equations", &multiview::normal_equations, nb::arg("points"), nb::arg("normals"), nb::arg("owner"),
        nb::arg("poses"), nb::arg("walls"), nb::arg("wall_normals"), nb::arg("normal_weight"), nb::arg("partners"),
        nb::arg("scale"));
  m.def("solve_positive", &multiview::solve_positive, nb::arg("matrix"), nb::arg("right"));
}
