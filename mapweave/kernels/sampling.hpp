// Samples along lines. The twin and the words are in lines/sampling.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <tuple>
#include <vector>

#include "arrays.hpp"

namespace sampling {

constexpr double kMost = 1e8;  // samples

// Samples, line by line: where they are and face, of which line, and how many metres of it each stands for.
struct LineSamples {
  std::vector<double> points, normals;
  std::vector<int64_t> owner;
  std::vector<double> metres;
};

inline LineSamples samples_of(In<double, 2> segments, double spacing) {
  if (segments.shape(1) != 4 || !(spacing > 0)) throw std::invalid_argument("segments (n, 4), spacing > 0 expected");
  const size_t lines = segments.shape(0);
  std::vector<double> length(lines), count(lines);
  double all = 0;
  for (size_t k = 0; k < lines; ++k) {
    const double* s = segments.data() + 4 * k;
    length[k] = std::hypot(s[2] - s[0], s[3] - s[1]);
    if (!std::isfinite(length[k])) throw std::invalid_argument("segments: finite numbers expected");
    count[k] = std::max(1.0, std::nearbyint(length[k] / spacing));
    all += count[k];
  }
  if (!(all <= kMost)) throw std::invalid_argument("spacing: fewer samples expected");
  const size_t n = static_cast<size_t>(all);
  std::vector<double> points(2 * n), normals(2 * n), metres(n);
  std::vector<int64_t> owner(n);
  for (size_t k = 0, at = 0; k < lines; ++k) {
    const double* s = segments.data() + 4 * k;
    const double dx = s[2] - s[0], dy = s[3] - s[1], unit = std::max(length[k], 1e-12);
    for (double rank = 0; rank < count[k]; ++rank, ++at) {
      const double fraction = (rank + 0.5) / count[k];
      points[2 * at] = s[0] + fraction * dx, points[2 * at + 1] = s[1] + fraction * dy;
      normals[2 * at] = -dy / unit, normals[2 * at + 1] = dx / unit;
      owner[at] = static_cast<int64_t>(k);
      metres[at] = length[k] / count[k];
    }
  }
  return {std::move(points), std::move(normals), std::move(owner), std::move(metres)};
}

inline std::tuple<Out<double>, Out<double>, Out<int64_t>, Out<double>> sample_lines(In<double, 2> segments,
                                                                                    double spacing) {
  LineSamples found = samples_of(segments, spacing);
  const size_t n = found.owner.size();
  return {give(std::move(found.points), {n, 2}), give(std::move(found.normals), {n, 2}),
          give(std::move(found.owner), {n}), give(std::move(found.metres), {n})};
}

// A segment in equal parts, each `spacing` long at most.
struct Parts {
  double x, y, u, v, length, count, part;

  Parts(const double* s, double spacing) : x(s[0]), y(s[1]) {
    const double dx = s[2] - s[0], dy = s[3] - s[1];
    length = std::hypot(dx, dy);
    u = dx / std::max(length, 1e-12), v = dy / std::max(length, 1e-12);
    count = std::max(1.0, std::ceil(length / spacing)), part = length / count;
  }
};

inline std::vector<Parts> parts_of(In<double, 2> segments, double spacing) {
  if (segments.shape(1) != 4 || !(spacing > 0)) throw std::invalid_argument("segments (n, 4), spacing > 0 expected");
  std::vector<Parts> parts;
  parts.reserve(segments.shape(0));
  double all = 0;
  for (size_t k = 0; k < segments.shape(0); ++k) all += parts.emplace_back(segments.data() + 4 * k, spacing).count;
  if (!(all <= kMost)) throw std::invalid_argument("finite segments, fewer samples expected");
  return parts;
}

// The middles of all parts.
inline std::vector<double> middles_of(const std::vector<Parts>& parts) {
  double all = 0;
  for (const Parts& p : parts) all += p.count;
  std::vector<double> points(2 * static_cast<size_t>(all));
  double* at = points.data();
  for (const Parts& p : parts)
    for (double rank = 0; rank < p.count; ++rank, at += 2) {
      const double along = (rank + 0.5) * p.part;
      at[0] = p.x + along * p.u, at[1] = p.y + along * p.v;
    }
  return points;
}

inline std::tuple<Out<double>, Out<double>, Out<double>, Out<int64_t>> sample_parts(In<double, 2> segments,
                                                                                    double spacing) {
  const std::vector<Parts> parts = parts_of(segments, spacing);
  std::vector<double> points = middles_of(parts);
  const size_t n = points.size() / 2;
  std::vector<double> directions(2 * n), lengths(n);
  std::vector<int64_t> owner(n);
  for (size_t k = 0, at = 0; k < parts.size(); ++k)
    for (double rank = 0; rank < parts[k].count; ++rank, ++at) {
      directions[2 * at] = parts[k].u, directions[2 * at + 1] = parts[k].v;
      lengths[at] = parts[k].part, owner[at] = static_cast<int64_t>(k);
    }
  return {give(std::move(points), {n, 2}), give(std::move(directions), {n, 2}), give(std::move(lengths), {n}),
          give(std::move(owner), {n})};
}

}  // namespace sampling

inline void bind_sampling(nb::module_& m) {
  m.def("sample_lines", &sampling::sample_lines, nb::arg("segments"), nb::arg("spacing"));
  m.def("sample_parts", &sampling::sample_parts, nb::arg("segments"), nb::arg("spacing"));
}
