// What samples of walls find in a raster: verification. The twins and the words are in matching/judging.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "motions.hpp"

namespace judging {

// The cells of a raster, and where a place [m] is among them.
struct Cells {
  double x, y, cell;
  int64_t rows, columns;

  // -1 outside; what lies beyond was not looked at.
  int64_t at(double px, double py) const {
    const double i = (px - x) / cell, j = (py - y) / cell;
    if (!(i >= 0 && j >= 0 && i < static_cast<double>(rows) && j < static_cast<double>(columns))) return -1;
    return static_cast<int64_t>(i) * columns + static_cast<int64_t>(j);
  }
};

inline void check_oriented(In<double, 2> points, In<double, 2> normals) {
  if (points.shape(1) != 2 || normals.shape(1) != 2 || points.shape(0) != normals.shape(0))
    throw std::invalid_argument("points and normals: (n, 2) each expected");
}

// A map's raster, and where the walls in it face.
struct Raster {
  Cells cells;
  const int32_t* nearest;
  const float *distance, *depth;
  const double* facing;
  int64_t walls;
};

inline Raster raster_of(In<double, 2> facing, In<int32_t, 2> nearest, In<float, 2> distance, In<float, 2> depth,
                        In<double, 1> origin, double cell) {
  if (facing.shape(1) != 2) throw std::invalid_argument("facing (m, 2) expected");
  for (const auto& other : {distance, depth})
    if (other.shape(0) != nearest.shape(0) || other.shape(1) != nearest.shape(1))
      throw std::invalid_argument("nearest, distance and depth: of one shape expected");
  if (origin.shape(0) != 2 || !(cell > 0)) throw std::invalid_argument("origin (2,), cell > 0 expected");
  const Cells cells{origin(0), origin(1), cell, static_cast<int64_t>(nearest.shape(0)),
                    static_cast<int64_t>(nearest.shape(1))};
  return {cells, nearest.data(), distance.data(), depth.data(), facing.data(), static_cast<int64_t>(facing.shape(0))};
}

inline motions::Motion motion_of(In<double, 1> pose) {
  if (pose.shape(0) != 3) throw std::invalid_argument("pose (3,) expected");
  return {pose(0), pose(1), pose(2)};
}

// When samples coincide and when they contradict.
struct Limits {
  double closeness, min_cosine, clearance;
};

// Calls `tell(sample, whether it coincides, whether it was seen through, how far the wall is)` for those in the raster.
template <typename Tell>
void judge(In<double, 2> points, In<double, 2> normals, In<float, 1> own_depth, const motions::Motion& motion,
           const Raster& raster, const Limits& limits, Tell tell) {
  check_oriented(points, normals);
  if (own_depth.shape(0) != points.shape(0)) throw std::invalid_argument("own_depth (n,) expected");
  const double c = std::cos(motion.theta), s = std::sin(motion.theta);
  const float close = static_cast<float>(limits.closeness), deep = static_cast<float>(limits.clearance);
  for (size_t k = 0; k < points.shape(0); ++k) {
    const double *q = points.data() + 2 * k, *m = normals.data() + 2 * k;
    const int64_t at = raster.cells.at(c * q[0] - s * q[1] + motion.x, s * q[0] + c * q[1] + motion.y);
    if (at < 0) continue;
    bool coincides = false, through = false;
    if (raster.distance[at] < close) {
      const int32_t wall = raster.nearest[at];
      if (wall < 0 || wall >= raster.walls) throw std::invalid_argument("nearest: numbers of samples expected");
      const double* f = raster.facing + 2 * wall;
      coincides = (c * m[0] - s * m[1]) * f[0] + (s * m[0] + c * m[1]) * f[1] > limits.min_cosine;
    } else {
      through = raster.depth[at] > deep && own_depth.data()[k] < deep;
    }
    tell(k, coincides, through, raster.distance[at]);
  }
}

// Which samples coincide with walls and which were seen through.
inline std::tuple<Out<uint8_t>, Out<uint8_t>> judge_samples(In<double, 2> points, In<double, 2> normals,
                                                            In<float, 1> own_depth, In<double, 1> pose,
                                                            In<double, 2> facing, In<int32_t, 2> nearest,
                                                            In<float, 2> distance, In<float, 2> depth,
                                                            In<double, 1> origin, double cell, double closeness,
                                                            double min_cosine, double clearance) {
  const size_t n = points.shape(0);
  std::vector<uint8_t> coincides(n, 0), through(n, 0);
  judge(points, normals, own_depth, motion_of(pose), raster_of(facing, nearest, distance, depth, origin, cell),
        {closeness, min_cosine, clearance},
        [&](size_t k, bool is_on, bool is_seen_through, float) { coincides[k] = is_on, through[k] = is_seen_through; });
  return {give(std::move(coincides), {n}), give(std::move(through), {n})};
}

// The median of some distances; infinite without any.
inline double median(std::vector<float>& apart) {
  if (apart.empty()) return std::numeric_limits<double>::infinity();
  const auto upper = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
  std::nth_element(apart.begin(), upper, apart.end());
  const double above = *upper, below = apart.size() % 2 ? above : *std::max_element(apart.begin(), upper);
  return (below + above) / 2;
}

// A map: samples of its walls, what they stand for and count where they are missing, and its raster.
struct Map {
  In<double, 2> points, normals;
  In<float, 1> own_depth;
  In<double, 1> weight, missing;
  Raster raster;
};

using Weighed = std::tuple<double, double, double, double>;

// What the samples of `other` say in `map`, summed: metres in common and contradicted, how far the walls are, and how
// well they hold.
inline Weighed weigh(const Map& map, const Map& other, const motions::Motion& motion, const Limits& limits) {
  if (other.weight.shape(0) != other.points.shape(0) || other.missing.shape(0) != other.points.shape(0))
    throw std::invalid_argument("weight and missing (n,) expected");
  double common = 0, contradicted = 0, xx = 0, xy = 0, yy = 0;
  std::vector<float> apart;
  judge(other.points, other.normals, other.own_depth, motion, map.raster, limits,
        [&](size_t k, bool is_on, bool is_seen_through, float far) {
          const double w = other.weight.data()[k], *m = other.normals.data() + 2 * k;
          if (is_seen_through) contradicted += w * other.missing.data()[k];
          if (!is_on) return;
          apart.push_back(far);
          common += w, xx += w * m[0] * m[0], xy += w * m[0] * m[1], yy += w * m[1] * m[1];
        });
  const double held = (xx + yy) / 2 - std::hypot((xx - yy) / 2, xy);
  return {common, contradicted, median(apart), held};
}

inline std::pair<Weighed, Weighed> weigh_maps(
    In<double, 2> points, In<double, 2> normals, In<float, 1> own_depth, In<double, 1> weight, In<double, 1> missing,
    In<int32_t, 2> nearest, In<float, 2> distance, In<float, 2> depth, In<double, 1> origin, double cell,
    In<double, 2> other_points, In<double, 2> other_normals, In<float, 1> other_own_depth, In<double, 1> other_weight,
    In<double, 1> other_missing, In<int32_t, 2> other_nearest, In<float, 2> other_distance, In<float, 2> other_depth,
    In<double, 1> other_origin, double other_cell, In<double, 1> pose, double closeness, double min_cosine,
    double clearance) {
  const Map map{points, normals, own_depth, weight, missing,
                raster_of(normals, nearest, distance, depth, origin, cell)};
  const Map other{other_points, other_normals, other_own_depth, other_weight, other_missing,
                  raster_of(other_normals, other_nearest, other_distance, other_depth, other_origin, other_cell)};
  const motions::Motion there = motion_of(pose);
  const Limits limits{closeness, min_cosine, clearance};
  return {weigh(map, other, there, limits), weigh(other, map, there.inverse(), limits)};
}

}  // namespace judging

inline void bind_judging(nb::module_& m) {
  m.def("judge_samples", &judging::judge_samples, nb::arg("points"), nb::arg("normals"), nb::arg("own_depth"),
        nb::arg("pose"), nb::arg("facing"), nb::arg("nearest"), nb::arg("distance"), nb::arg("depth"),
        nb::arg("origin"), nb::arg("cell"), nb::arg("closeness"), nb::arg("min_cosine"), nb::arg("clearance"));
  m.def("weigh_maps", &judging::weigh_maps, nb::arg("points"), nb::arg("normals"), nb::arg("own_depth"),
        nb::arg("weight"), nb::arg("missing"), nb::arg("nearest"), nb::arg("distance"), nb::arg("depth"),
        nb::arg("origin"), nb::arg("cell"), nb::arg("other_points"), nb::arg("other_normals"),
        nb::arg("other_own_depth"), nb::arg("other_weight"), nb::arg("other_missing"), nb::arg("other_nearest"),
        nb::arg("other_distance"), nb::arg("other_depth"), nb::arg("other_origin"), nb::arg("other_cell"),
        nb::arg("pose"), nb::arg("closeness"), nb::arg("min_cosine"), nb::arg("clearance"));
}
