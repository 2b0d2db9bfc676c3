// Which longer segment each sliver lies along. The twin and the words are in slivers.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "merging_rules.hpp"

namespace slivers {

using merging::Segment;
using merging::Vector;

struct Rules {
  double max_length, max_distance, least_cosine;
};

// How far `sliver` reaches away from `segment` [m], infinite where their directions differ too much.
inline double distance(const Segment& sliver, const Segment& segment, const Rules& rules) {
  const double cosine = merging::dot(segment.along, sliver.along) / (segment.length * std::max(sliver.length, 1e-12));
  if (!(cosine >= rules.least_cosine)) return merging::kNever;
  return std::sqrt(std::max(merging::squared_distance(sliver.start, segment), merging::squared_distance(sliver.end, segment)));
}

inline bool apart(double a, double b, double low, double high, double reach) {
  return std::max(a, b) < low - reach || std::min(a, b) > high + reach;
}

inline Out<int64_t> owners(In<double, 2> segments, double max_length, double max_distance, double max_angle) {
  if (segments.shape(1) != 4) throw std::invalid_argument("segments: (n, 4) expected");
  const Rules rules{max_length, max_distance, std::cos(max_angle)};
  const size_t n = segments.shape(0);
  std::vector<Segment> all;
  all.reserve(n);
  for (size_t i = 0; i < n; ++i) {
    const double* s = segments.data() + 4 * i;
    all.push_back(Segment::of({s[0], s[1]}, {s[2], s[3]}, 0.0));
  }
  std::vector<int64_t> owner(n);
  for (size_t i = 0; i < n; ++i) {
    owner[i] = static_cast<int64_t>(i);
    if (!(all[i].length <= rules.max_length)) continue;
    const double reach = max_distance + 1e-9;
    const double low_x = std::min(all[i].start.x, all[i].end.x), high_x = std::max(all[i].start.x, all[i].end.x);
    const double low_y = std::min(all[i].start.y, all[i].end.y), high_y = std::max(all[i].start.y, all[i].end.y);
    double least = merging::kNever;
    for (size_t j = 0; j < n; ++j) {
      const double* s = segments.data() + 4 * j;
      if (apart(s[0], s[2], low_x, high_x, reach) || apart(s[1], s[3], low_y, high_y, reach)) continue;
      if (!(all[j].length > all[i].length)) continue;  // so no two own each other
      const double away = distance(all[i], all[j], rules);
      if (away < least) least = away, owner[i] = static_cast<int64_t>(j);
    }
    if (!(least <= rules.max_distance)) owner[i] = static_cast<int64_t>(i);
  }
  for (size_t i = 0; i < n; ++i)  // a sliver of a sliver
    while (owner[i] != owner[static_cast<size_t>(owner[i])]) owner[i] = owner[static_cast<size_t>(owner[i])];
  return give(std::move(owner), {n});
}

}  // namespace slivers

inline void bind_slivers(nb::module_& m) {
  m.def("sliver_owners", &slivers::owners, nb::arg("segments"), nb::arg("max_length"), nb::arg("max_distance"),
        nb::arg("max_angle"));
}
