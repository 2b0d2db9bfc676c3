// Points and paths in polygons, by their edges. The twin and the words are in polygons.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"

namespace polygons {

// The edges that reach into each of some strips of equal height: of these alone is asked.
class Strips {
 public:
  explicit Strips(In<double, 2> edges) : edges_(edges.data()), count_(edges.shape(0)) {
    if (edges.shape(1) != 4) throw std::invalid_argument("edges: (n, 4) expected");
    if (!count_) return;
    for (size_t k = 0; k < 4 * count_; ++k)
      if (!std::isfinite(edges_[k])) throw std::invalid_argument("edges: finite numbers expected");
    low_ = high_ = edges_[1];
    for (size_t k = 0; k < count_; ++k) {
      low_ = std::min(low_, std::min(edges_[4 * k + 1], edges_[4 * k + 3]));
      high_ = std::max(high_, std::max(edges_[4 * k + 1], edges_[4 * k + 3]));
    }
    const int64_t most = std::max<int64_t>(1, static_cast<int64_t>(count_));
    strips_ = std::min<int64_t>(most, static_cast<int64_t>((high_ - low_) / 0.25) + 1);
    height_ = std::max((high_ - low_) / static_cast<double>(strips_), 1e-9);
    of_.resize(static_cast<size_t>(strips_));
    for (size_t k = 0; k < count_; ++k) {
      const double* e = edges_ + 4 * k;
      const int64_t last = strip(std::max(e[1], e[3]));
      for (int64_t s = strip(std::min(e[1], e[3])); s <= last; ++s) of_[s].push_back(static_cast<int64_t>(k));
    }
  }

  bool contains(double x, double y) const {
    if (!count_ || y < low_ || y > high_) return false;
    bool inside = false;
    for (const int64_t k : of_[strip(y)]) {
      const double* e = edges_ + 4 * k;
      if ((e[1] <= y) == (e[3] <= y)) continue;
      if (e[0] + (y - e[1]) / (e[3] - e[1]) * (e[2] - e[0]) > x) inside = !inside;
    }
    return inside;
  }

  // [m] to the nearest edge, `most` at the most.
  double distance(double x, double y, double most) const {
    double best = most * most;
    each(y - most, y + most, [&](const double* e) {
      const double dx = e[2] - e[0], dy = e[3] - e[1], squared = dx * dx + dy * dy;
      const double t = squared > 0 ? std::clamp(((x - e[0]) * dx + (y - e[1]) * dy) / squared, 0.0, 1.0) : 0.0;
      const double u = e[0] + t * dx - x, v = e[1] + t * dy - y;
      best = std::min(best, u * u + v * v);
    });
    return std::sqrt(best);
  }

  // [m] of the way from one place to another that is inside.
  double length_inside(const double* a, const double* b, std::vector<double>& at) const {
    const double dx = b[0] - a[0], dy = b[1] - a[1], length = std::hypot(dx, dy);
    if (!(length > 0)) return 0;
    at.clear();
    seen_.clear();
    each(std::min(a[1], b[1]), std::max(a[1], b[1]), [&](const double* e) {
      const double first = dx * (e[1] - a[1]) - dy * (e[0] - a[0]);
      const double second = dx * (e[3] - a[1]) - dy * (e[2] - a[0]);
      if ((first <= 0) == (second <= 0)) return;
      const double part = first / (first - second);
      const double x = e[0] + part * (e[2] - e[0]) - a[0], y = e[1] + part * (e[3] - e[1]) - a[1];
      const double t = (x * dx + y * dy) / (length * length);
      if (t > 0 && t < 1 && std::find(seen_.begin(), seen_.end(), e) == seen_.end()) at.push_back(t), seen_.push_back(e);
    });
    std::sort(at.begin(), at.end());
    bool inside = contains(a[0], a[1]);
    double before = 0, sum = 0;
    for (const double t : at) {
      if (inside) sum += t - before;
      inside = !inside, before = t;
    }
    if (inside) sum += 1 - before;
    return sum * length;
  }

 private:
  const double* edges_;
  size_t count_;
  int64_t strips_ = 0;
  double low_ = 0, high_ = 0, height_ = 1;
  std::vector<std::vector<int64_t>> of_;
  mutable std::vector<const double*> seen_;  // crossed in an earlier strip already

  int64_t strip(double y) const {
    return std::clamp<int64_t>(static_cast<int64_t>(std::floor((y - low_) / height_)), 0, strips_ - 1);
  }

  template <typename F>
  void each(double bottom, double top, F&& use) const {
    if (!count_ || top < low_ || bottom > high_) return;
    const int64_t last = strip(top);
    for (int64_t s = strip(bottom); s <= last; ++s)
      for (const int64_t k : of_[s]) use(edges_ + 4 * k);
  }
};

inline Out<double> depths(In<double, 2> points, In<double, 2> edges, double most) {
  if (points.shape(1) != 2) throw std::invalid_argument("points: (n, 2) expected");
  const Strips strips(edges);
  const size_t n = points.shape(0);
  std::vector<double> depth(n, 0.0);
  for (size_t i = 0; i < n; ++i) {
    const double x = points.data()[2 * i], y = points.data()[2 * i + 1];
    if (strips.contains(x, y)) depth[i] = strips.distance(x, y, most);
  }
  return give(std::move(depth), {n});
}

inline Out<double> lengths_inside(In<double, 3> paths, In<double, 2> edges) {
  if (paths.shape(2) != 2) throw std::invalid_argument("paths: (n, k, 2) expected");
  const Strips strips(edges);
  const size_t n = paths.shape(0), k = paths.shape(1);
  std::vector<double> lengths(n, 0.0), at;
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j + 1 < k; ++j) {
      const double* a = paths.data() + 2 * (i * k + j);
      lengths[i] += strips.length_inside(a, a + 2, at);
    }
  return give(std::move(lengths), {n});
}

}  // namespace polygons

inline void bind_polygons(nb::module_& m) {
  m.def("depths", &polygons::depths, nb::arg("points"), nb::arg("edges"), nb::arg("most"));
  m.def("lengths_inside", &polygons::lengths_inside, nb::arg("paths"), nb::arg("edges"));
}
