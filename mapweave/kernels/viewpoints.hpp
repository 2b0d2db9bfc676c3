// What earlier scans saw through. The twin and the words are in viewpoints.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <vector>

#include "arrays.hpp"
#include "sectors.hpp"

namespace viewpoints {

struct Viewpoint {
  std::vector<double> clear;  // [m] that each beam saw through
  double first, spacing;      // [rad] of the first beam, between beams
  double x, y, cosine, sine;  // of the sensor
  double farthest;            // [m] of all beams
  mutable std::optional<sectors::Beams> beams;  // once they are asked
  mutable double clearance = 0;                 // [m] that they were asked with

  bool saw_through(double px, double py, double by) const {
    const double dx = px - x, dy = py - y;
    const double squared = dx * dx + dy * dy;
    const double most = farthest - by;
    if (!(most > 0 && squared < most * most)) return false;
    if (!beams || clearance != by) {
      beams.emplace(clear.data(), static_cast<int64_t>(clear.size()), first, spacing, by);
      clearance = by;
    }
    return beams->before(cosine * dx + sine * dy, cosine * dy - sine * dx, squared);
  }
};

class Viewpoints {
 public:
  explicit Viewpoints(int64_t capacity) : capacity_(capacity) {
    if (capacity < 1) throw std::invalid_argument("capacity: 1 or more expected");
  }

  int64_t size() const { return static_cast<int64_t>(kept_.size()); }

  void add(In<double, 1> clear, double first, double spacing, In<double, 1> pose) {
    if (clear.shape(0) < 1 || pose.shape(0) != 3) throw std::invalid_argument("clear: a beam or more, pose: (3,) expected");
    const auto made = std::make_shared<Viewpoint>();
    Viewpoint& point = *made;
    point.clear.assign(clear.data(), clear.data() + clear.shape(0));
    point.first = first, point.spacing = spacing;
    point.x = pose.data()[0], point.y = pose.data()[1];
    point.cosine = std::cos(pose.data()[2]), point.sine = std::sin(pose.data()[2]);
    point.farthest = *std::max_element(point.clear.begin(), point.clear.end());
    kept_.push_back(made);
    if (size() > capacity_) kept_.pop_front();
  }

  // (k, n) which points, placed at each pose, one of the `nearest` viewpoints saw through.
  Out<bool> free(In<double, 2> points, In<double, 2> poses, In<bool, 2> asked, int64_t nearest,
                 double clearance) const {
    const size_t n = points.shape(0), k = poses.shape(0);
    if (points.shape(1) != 2 || poses.shape(1) != 3 || asked.shape(0) != k || asked.shape(1) != n)
      throw std::invalid_argument("points (n, 2), poses (k, 3), asked (k, n) expected");
    auto* held = new std::unique_ptr<bool[]>(new bool[n * k]());
    nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::unique_ptr<bool[]>*>(p); });
    bool* out = held->get();
    for (size_t j = 0; j < k; ++j) {
      const double* pose = poses.data() + 3 * j;
      const std::vector<const Viewpoint*> witnesses = about(pose[0], pose[1], nearest);
      const double c = std::cos(pose[2]), s = std::sin(pose[2]);
      for (size_t i = 0; i < n; ++i) {
        if (!asked.data()[j * n + i]) continue;
        const double* p = points.data() + 2 * i;
        const double x = pose[0] + c * p[0] - s * p[1], y = pose[1] + s * p[0] + c * p[1];
        out[j * n + i] = std::any_of(witnesses.begin(), witnesses.end(), [&](const Viewpoint* witness) {
          return witness->saw_through(x, y, clearance);
        });
      }
    }
    return Out<bool>(out, {k, n}, owner);
  }

  // The nearest to a place; of two as near, the older.
  std::vector<const Viewpoint*> about(double x, double y, int64_t count) const {
    std::vector<std::pair<double, size_t>> order;
    for (size_t i = 0; i < kept_.size(); ++i) order.emplace_back(std::hypot(kept_[i]->x - x, kept_[i]->y - y), i);
    const size_t taken = std::min(order.size(), static_cast<size_t>(std::max<int64_t>(count, 0)));
    std::partial_sort(order.begin(), order.begin() + static_cast<std::ptrdiff_t>(taken), order.end());
    std::vector<const Viewpoint*> nearest;
    for (size_t i = 0; i < taken; ++i) nearest.push_back(kept_[order[i].second].get());
    return nearest;
  }

  Viewpoints copy() const { return *this; }

 private:
  int64_t capacity_;
  std::deque<std::shared_ptr<const Viewpoint>> kept_;  // copies share them
};

}  // namespace viewpoints

inline void bind_viewpoints(nb::module_& m) {
  using viewpoints::Viewpoints;
  nb::class_<Viewpoints>(m, "Viewpoints")
      .def(nb::init<int64_t>(), nb::arg("capacity"))
      .def("__len__", &Viewpoints::size)
      .def("add", &Viewpoints::add, nb::arg("clear"), nb::arg("first"), nb::arg("spacing"), nb::arg("pose"))
      .def("free", &Viewpoints::free, nb::arg("points"), nb::arg("poses"), nb::arg("asked"), nb::arg("nearest"),
           nb::arg("clearance"))
      .def("copy", &Viewpoints::copy)
      .def("__deepcopy__", [](const Viewpoints& self, nb::handle) { return self; }, nb::arg("memo"));
}
