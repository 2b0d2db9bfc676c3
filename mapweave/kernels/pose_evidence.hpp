// What speaks for and against the poses of a scan. The twin and the words are in pose_evidence.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "point_map.hpp"
#include "viewpoints.hpp"

namespace pose_evidence {

struct Settings {
  double overlap, clearance;
  int64_t witnesses;
  point_map::Sight sight;
};

// (n,) which points, sensor frame, are in sight of it.
inline std::vector<char> in_sight(const In<double, 2>& points, const In<double, 2>& normals, const point_map::Sight& sight) {
  std::vector<char> found(points.shape(0));
  for (size_t i = 0; i < found.size(); ++i) {
    const double* p = points.data() + 2 * i;
    const double* m = normals.data() + 2 * i;
    const double distance = std::hypot(p[0], p[1]);
    const double cosine = -(p[0] * m[0] + p[1] * m[1]) / std::max(distance, 1e-9);
    found[i] = distance < sight.near || (cosine > sight.facing && distance < sight.far);
  }
  return found;
}

// (k, 3) how many of the points are explained at each pose, how many contradicted, and how many that
// would be are on loose things.
inline Out<int64_t> pose_evidence(const point_map::PointMap& known, const viewpoints::Viewpoints& viewpoints,
                                  In<double, 2> points, In<double, 2> normals, In<bool, 1> loose,
                                  In<double, 2> poses, const Settings& p) {
  const size_t n = points.shape(0), k = poses.shape(0);
  if (points.shape(1) != 2 || normals.shape(1) != 2 || normals.shape(0) != n || loose.shape(0) != n ||
      poses.shape(1) != 3)
    throw std::invalid_argument("points and normals: (n, 2) each, loose: (n,), poses: (k, 3) expected");
  const std::vector<char> judged = in_sight(points, normals, p.sight);
  std::vector<int64_t> counts(3 * k, 0);
  for (size_t j = 0; j < k; ++j) {
    const double* pose = poses.data() + 3 * j;
    const double c = std::cos(pose[2]), s = std::sin(pose[2]);
    const std::vector<const viewpoints::Viewpoint*> witnesses = viewpoints.about(pose[0], pose[1], p.witnesses);
    for (size_t i = 0; i < n; ++i) {
      const double* at = points.data() + 2 * i;
      if (known.explains_one(at, normals.data() + 2 * i, pose, c, s, p.overlap)) {
        ++counts[3 * j];
      } else if (judged[i]) {
        const double x = pose[0] + c * at[0] - s * at[1], y = pose[1] + s * at[0] + c * at[1];
        counts[3 * j + (loose.data()[i] ? 2 : 1)] += std::any_of(witnesses.begin(), witnesses.end(), [&](const viewpoints::Viewpoint* witness) {
          return witness->saw_through(x, y, p.clearance);
        });
      }
    }
  }
  return give(std::move(counts), {k, 3});
}

}  // namespace pose_evidence

inline void bind_pose_evidence(nb::module_& m) {
  using pose_evidence::Settings;
  nb::class_<Settings>(m, "EvidenceSettings")
      .def("__init__",
           [](Settings* self, double overlap, double clearance, int64_t witnesses, double sight, double far_sight,
              double facing) {
             new (self) Settings{overlap, clearance, witnesses, {sight, far_sight, facing}};
           },
           nb::arg("overlap"), nb::arg("clearance"), nb::arg("witnesses"), nb::arg("sight"), nb::arg("far_sight"),
           nb::arg("facing"))
      .def("__deepcopy__", [](const Settings& self, nb::handle) { return self; }, nb::arg("memo"));
  m.def("pose_evidence", &pose_evidence::pose_evidence, nb::arg("known"), nb::arg("viewpoints"), nb::arg("points"),
        nb::arg("normals"), nb::arg("loose"), nb::arg("poses"), nb::arg("settings"));
}
