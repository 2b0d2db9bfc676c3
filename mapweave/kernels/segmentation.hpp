// A scan's returns to line segments, and to oriented points. The twin and the words are in segmentation.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace segmentation {

struct Settings {
  double max_range, max_jump, grazing, tolerance, relative_tolerance;
  int64_t min_points;
  double min_length;
};

struct Line {
  double cx, cy, dx, dy;  // centre, unit direction
};

class Returns {
 public:
  Returns(In<double, 1> angles, In<double, 1> ranges, const Settings& p) : p_(p) {
    const size_t beams = angles.shape(0);
    if (ranges.shape(0) != beams) throw std::invalid_argument("angles and ranges: as many of each expected");
    for (size_t b = 0; b < beams; ++b) {
      const double r = ranges.data()[b];
      if (!(std::isfinite(r) && r <= p.max_range)) continue;
      beam_.push_back(static_cast<int64_t>(b));
      x_.push_back(r * std::cos(angles.data()[b]));
      y_.push_back(r * std::sin(angles.data()[b]));
      range_.push_back(r);
      angle_.push_back(angles.data()[b]);
      tolerance_.push_back(p.tolerance + p.relative_tolerance * r);
    }
  }

  // Segments in beam order, and the segment of each beam.
  void segments(std::vector<double>& found, std::vector<int64_t>& label) const {
    size_t first = 0;
    for (size_t k = 0; k < x_.size(); ++k)
      if (k + 1 == x_.size() || broken(k)) {
        run(first, k + 1, found, label);
        first = k + 1;
      }
  }

 private:
  Settings p_;
  std::vector<int64_t> beam_;
  std::vector<double> x_, y_, range_, angle_, tolerance_;

  // Whether one surface ends after return k.
  bool broken(size_t k) const {
    const double step = std::hypot(x_[k + 1] - x_[k], y_[k + 1] - y_[k]);
    const double turn = angle_[k + 1] - angle_[k];
    const double nearer = std::min(range_[k], range_[k + 1]);
    const double limit = std::max(p_.max_jump, nearer * turn / std::sin(p_.grazing));
    return step > std::min(limit, 4 * p_.max_jump) || beam_[k + 1] - beam_[k] > 3;
  }

  void run(size_t first, size_t last, std::vector<double>& found, std::vector<int64_t>& label) const {
    std::vector<std::pair<size_t, size_t>> pieces = straight_pieces(first, last), merged;
    for (auto [a, b] : pieces) {
      if (static_cast<int64_t>(b - a) < p_.min_points) continue;
      if (!merged.empty() && a < merged.back().second && straight(merged.back().first, b))
        merged.back().second = b;
      else
        merged.emplace_back(a, b);
    }
    for (auto [a, b] : merged) {
      const Line line = fit(a, b);
      double low = 0, high = 0;
      for (size_t k = a; k < b; ++k) {
        const double along = (x_[k] - line.cx) * line.dx + (y_[k] - line.cy) * line.dy;
        low = k == a ? along : std::min(low, along), high = k == a ? along : std::max(high, along);
      }
      if (high - low < p_.min_length) continue;
      const int64_t number = static_cast<int64_t>(found.size() / 4);
      found.insert(found.end(), {line.cx + low * line.dx, line.cy + low * line.dy, line.cx + high * line.dx,
                                 line.cy + high * line.dy});
      for (size_t k = a; k < b; ++k) label[beam_[k]] = number;
    }
  }

  // Splits at the return farthest from the chord until all pieces are straight.
  std::vector<std::pair<size_t, size_t>> straight_pieces(size_t first, size_t last) const {
    std::vector<std::pair<size_t, size_t>> pieces, stack{{first, last}};
    while (!stack.empty()) {
      const auto [a, b] = stack.back();
      stack.pop_back();
      if (b - a <= 2) {
        pieces.emplace_back(a, b);
        continue;
      }
      const double cx = x_[b - 1] - x_[a], cy = y_[b - 1] - y_[a];
      const double length = std::max(std::hypot(cx, cy), 1e-9);
      size_t worst = a;
      double most = -1;
      for (size_t k = a; k < b; ++k) {
        const double away = std::abs(cx * (y_[k] - y_[a]) - cy * (x_[k] - x_[a])) / length;
        const double excess = away / tolerance_[k];
        if (excess > most) most = excess, worst = k;
      }
      if (most <= 1 || worst == a || worst == b - 1) {
        pieces.emplace_back(a, b);
      } else {  // the corner belongs to both sides, so that polylines stay connected there
        stack.emplace_back(worst, b);
        stack.emplace_back(a, worst + 1);
      }
    }
    std::sort(pieces.begin(), pieces.end());
    return pieces;
  }

  // Line of least squares across the returns, along their order.
  Line fit(size_t a, size_t b) const {
    const double n = static_cast<double>(b - a);
    double cx = 0, cy = 0, xx = 0, xy = 0, yy = 0;
    for (size_t k = a; k < b; ++k) cx += x_[k], cy += y_[k];
    cx /= n, cy /= n;
    for (size_t k = a; k < b; ++k) {
      const double dx = x_[k] - cx, dy = y_[k] - cy;
      xx += dx * dx, xy += dx * dy, yy += dy * dy;
    }
    const double angle = 0.5 * std::atan2(2 * xy, xx - yy);  // the major axis of the scatter matrix
    const double dx = std::cos(angle), dy = std::sin(angle);
    const bool back = dx * (x_[b - 1] - x_[a]) + dy * (y_[b - 1] - y_[a]) < 0;
    return {cx, cy, back ? -dx : dx, back ? -dy : dy};
  }

  bool straight(size_t a, size_t b) const {
    const Line line = fit(a, b);
    for (size_t k = a; k < b; ++k)
      if (std::abs(-line.dy * (x_[k] - line.cx) + line.dx * (y_[k] - line.cy)) > tolerance_[k]) return false;
    return true;
  }
};

// ((n, 4) segments, (beams,) label): see segmentation.py.
inline std::tuple<Out<double>, Out<int64_t>> extract_segments(In<double, 1> angles, In<double, 1> ranges, const Settings& p) {
  std::vector<double> found;
  std::vector<int64_t> label(angles.shape(0), -1);
  Returns(angles, ranges, p).segments(found, label);
  const size_t n = found.size() / 4, beams = label.size();
  return std::make_tuple(give(std::move(found), {n, 4}), give(std::move(label), {beams}));
}

using OrientedPoints = std::tuple<Out<double>, Out<double>, Out<int64_t>>;

struct Oriented {
  std::vector<double> points, normals;
  std::vector<int64_t> segment;

  void add(double x, double y, double dx, double dy, int64_t on) {
    const double length = std::max(std::hypot(dx, dy), 1e-12);
    points.insert(points.end(), {x, y});
    normals.insert(normals.end(), {-dy / length, dx / length});
    segment.push_back(on);
  }

  OrientedPoints give_away() {
    const size_t n = segment.size();
    return std::make_tuple(give(std::move(points), {n, 2}), give(std::move(normals), {n, 2}),
                          give(std::move(segment), {n}));
  }
};

// Oriented points of the returns, and between them on each segment: see segmentation.py.
inline std::tuple<OrientedPoints, OrientedPoints> orient(In<double, 1> angles, In<double, 1> ranges, In<double, 2> segments, In<int64_t, 1> label,
                        double max_range, double max_gap, double spacing) {
  const size_t beams = angles.shape(0);
  const int64_t count = static_cast<int64_t>(segments.shape(0));
  if (ranges.shape(0) != beams || label.shape(0) != beams || segments.shape(1) != 4)
    throw std::invalid_argument("angles, ranges and label: as many of each, segments (n, 4) expected");
  std::vector<double> x, y;
  std::vector<int64_t> on;
  for (size_t b = 0; b < beams; ++b) {
    const double r = ranges.data()[b];
    if (!(std::isfinite(r) && r <= max_range)) continue;
    if (label.data()[b] >= count) throw std::invalid_argument("label: a segment that there is expected");
    x.push_back(r * std::cos(angles.data()[b]));
    y.push_back(r * std::sin(angles.data()[b]));
    on.push_back(label.data()[b]);
  }
  Oriented returns, between;
  const auto along = [&](int64_t segment) {
    const double* s = segments.data() + 4 * segment;
    return std::pair<double, double>{s[2] - s[0], s[3] - s[1]};
  };
  const auto step = [&](size_t k) {  // to the next return, nothing where that is too far away
    const double dx = x[k + 1] - x[k], dy = y[k + 1] - y[k];
    return std::hypot(dx, dy) > max_gap ? std::pair<double, double>{0, 0} : std::pair<double, double>{dx, dy};
  };
  for (size_t k = 0; x.size() >= 2 && k < x.size(); ++k) {
    std::pair<double, double> direction{0, 0};
    if (on[k] >= 0) {
      direction = along(on[k]);
    } else {
      if (k + 1 < x.size()) direction = step(k);
      if (k > 0) {
        const auto before = step(k - 1);
        direction = {direction.first + before.first, direction.second + before.second};
      }
    }
    if (std::hypot(direction.first, direction.second) > 0)
      returns.add(x[k], y[k], direction.first, direction.second, on[k]);
  }
  std::vector<size_t> labelled;
  for (size_t k = 0; k < x.size(); ++k)
    if (on[k] >= 0) labelled.push_back(k);
  for (size_t m = 0; m + 1 < labelled.size(); ++m) {
    const size_t a = labelled[m], b = labelled[m + 1];
    if (on[a] != on[b]) continue;
    const double dx = x[b] - x[a], dy = y[b] - y[a];
    const int64_t pieces = std::max<int64_t>(0, static_cast<int64_t>(std::ceil(std::hypot(dx, dy) / spacing)) - 1);
    const auto direction = along(on[a]);
    for (int64_t k = 1; k <= pieces; ++k) {
      const double share = static_cast<double>(k) / static_cast<double>(pieces + 1);
      between.add(x[a] + share * dx, y[a] + share * dy, direction.first, direction.second, on[a]);
    }
  }
  return std::make_tuple(returns.give_away(), between.give_away());
}

}  // namespace segmentation

inline void bind_segmentation(nb::module_& m) {
  using segmentation::Settings;
  nb::class_<Settings>(m, "SegmentationSettings")
      .def("__init__",
           [](Settings* self, double max_range, double max_jump, double grazing, double tolerance,
              double relative_tolerance, int64_t min_points, double min_length) {
             new (self) Settings{max_range, max_jump, grazing, tolerance, relative_tolerance, min_points, min_length};
           },
           nb::arg("max_range"), nb::arg("max_jump"), nb::arg("grazing"), nb::arg("tolerance"),
           nb::arg("relative_tolerance"), nb::arg("min_points"), nb::arg("min_length"));
  m.def("extract_segments", &segmentation::extract_segments, nb::arg("angles"), nb::arg("ranges"), nb::arg("settings"));
  m.def("orient", &segmentation::orient, nb::arg("angles"), nb::arg("ranges"), nb::arg("segments"), nb::arg("label"),
        nb::arg("max_range"), nb::arg("max_gap"), nb::arg("spacing"));
}
