// What was seen near segments, and which segments to keep. Twins and words are in evidence.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "arrays.hpp"
#include "grid.hpp"

namespace evidence {

struct Line {
  double x, y, u, v, length;
  explicit Line(const double* s) : x(s[0]), y(s[1]) {
    const double dx = s[2] - s[0], dy = s[3] - s[1];
    length = std::hypot(dx, dy);
    const double by = std::max(length, 1e-12);
    u = dx / by, v = dy / by;
  }
  // [m] past its ends; a segment of no length has no direction either, and all is past its end.
  double beyond(double dx, double dy, double along) const {
    return length > 0 ? std::max(std::max(-along, along - length), 0.0) : std::hypot(dx, dy);
  }
};

// A point near a segment: where it lies along and across it, and how far past its ends [m].
struct Near {
  int64_t segment, point;
  double along, across, beyond;
};

// One number of each pair, in their order.
template <typename T, typename F>
Out<T> column(const std::vector<Near>& pairs, F&& of) {
  std::vector<T> values(pairs.size());
  std::transform(pairs.begin(), pairs.end(), values.begin(), of);
  return give(std::move(values), {pairs.size()});
}

inline auto near_pairs(In<double, 2> segments, In<double, 2> points, In<double, 2> directions, double reach) {
  const size_t n = segments.shape(0), m = points.shape(0);
  if (segments.shape(1) != 4 || points.shape(1) != 2 || directions.shape(1) != 2 || directions.shape(0) != m)
    throw std::invalid_argument("segments (n, 4), points (m, 2), directions (m, 2) expected");
  if (!(reach > 0)) throw std::invalid_argument("reach: above 0 expected");
  for (size_t i = 0; i < 4 * n; ++i)
    if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
  const double *place = points.data(), *direction = directions.data();
  const Grid grid(place, m, std::max(reach, 0.1));
  std::vector<Near> pairs;
  std::vector<Line> lines;
  lines.reserve(n);
  for (size_t k = 0; k < n; ++k) {
    const double* s = segments.data() + 4 * k;
    const Line& line = lines.emplace_back(s);
    const size_t begin = pairs.size();
    grid.along(s, reach, [&](int64_t i) {
      const double dx = place[2 * i] - line.x, dy = place[2 * i + 1] - line.y;
      const double a = line.u * dx + line.v * dy, c = line.u * dy - line.v * dx;
      const double beyond = line.beyond(dx, dy, a);
      if (c * c + beyond * beyond <= reach * reach) pairs.push_back({static_cast<int64_t>(k), i, a, c, beyond});
    });
    std::sort(pairs.begin() + static_cast<std::ptrdiff_t>(begin), pairs.end(),
              [](const Near& one, const Near& other) { return one.point < other.point; });
  }
  const auto distance = [](const Near& p) {
    return p.beyond > 0 ? std::hypot(p.across, p.beyond) : std::abs(p.across);
  };
  const auto cosine = [&](const Near& p) {
    const Line& line = lines[static_cast<size_t>(p.segment)];
    return line.u * direction[2 * p.point] + line.v * direction[2 * p.point + 1];
  };
  return std::make_tuple(
      column<int64_t>(pairs, [](const Near& p) { return p.segment; }),
      column<int64_t>(pairs, [](const Near& p) { return p.point; }),
      column<double>(pairs, [](const Near& p) { return p.along; }),
      column<double>(pairs, [](const Near& p) { return p.across; }), column<double>(pairs, distance),
      column<double>(pairs, cosine));
}

// Pairs by one of their two ends: which pairs the k-th has.
struct ByEnd {
  std::vector<int64_t> start, pair;
  ByEnd(const int64_t* end, size_t pairs, size_t count) : start(count + 1, 0), pair(pairs) {
    for (size_t i = 0; i < pairs; ++i) ++start[end[i] + 1];
    for (size_t k = 0; k < count; ++k) start[k + 1] += start[k];
    std::vector<int64_t> next(start.begin(), start.end() - 1);
    for (size_t i = 0; i < pairs; ++i) pair[next[end[i]]++] = static_cast<int64_t>(i);
  }
};

inline Out<int64_t> take_greedily(int64_t count, In<int64_t, 1> segment, In<int64_t, 1> sample, In<bool, 1> explains,
                                  In<double, 1> weights, double price) {
  const size_t pairs = segment.shape(0), n = static_cast<size_t>(std::max<int64_t>(count, 0)), m = weights.shape(0);
  if (sample.shape(0) != pairs || explains.shape(0) != pairs)
    throw std::invalid_argument("segment, sample, explains: one length expected");
  for (size_t i = 0; i < pairs; ++i) {
    const bool known = segment.data()[i] >= 0 && segment.data()[i] < count && sample.data()[i] >= 0 &&
                       sample.data()[i] < static_cast<int64_t>(m);
    if (!known) throw std::invalid_argument("segment, sample: numbers of segments and of weights expected");
  }
  const ByEnd of_segment(segment.data(), pairs, n), of_sample(sample.data(), pairs, m);
  std::vector<double> left(weights.data(), weights.data() + m), gain(n, 0.0);
  for (size_t i = 0; i < pairs; ++i) {
    const double worth = left[sample.data()[i]];
    gain[segment.data()[i]] += explains.data()[i] ? worth : -worth;
  }
  std::vector<int64_t> chosen;
  while (n) {
    const size_t best = static_cast<size_t>(std::max_element(gain.begin(), gain.end()) - gain.begin());
    if (!(gain[best] > price)) break;
    chosen.push_back(static_cast<int64_t>(best));
    for (int64_t k = of_segment.start[best]; k < of_segment.start[best + 1]; ++k) {
      const int64_t settled = sample.data()[of_segment.pair[k]];
      if (left[settled] == 0.0) continue;
      for (int64_t j = of_sample.start[settled]; j < of_sample.start[settled + 1]; ++j) {
        const int64_t pair = of_sample.pair[j];
        gain[segment.data()[pair]] -= explains.data()[pair] ? left[settled] : -left[settled];
      }
      left[settled] = 0.0;
    }
    gain[best] = -std::numeric_limits<double>::infinity();  // nothing of it is left
  }
  const size_t kept = chosen.size();
  return give(std::move(chosen), {kept});
}

inline auto gather(In<double, 2> points, In<double, 2> directions, In<double, 1> weights, double cell,
                        int64_t bins) {
  const size_t n = points.shape(0);
  if (points.shape(1) != 2 || directions.shape(1) != 2 || directions.shape(0) != n || weights.shape(0) != n)
    throw std::invalid_argument("points (n, 2), directions (n, 2), weights (n,) expected");
  struct Key {
    int64_t i, j, bin;
    size_t number;
    bool operator<(const Key& o) const {
      if (i != o.i) return i < o.i;
      if (j != o.j) return j < o.j;
      return bin != o.bin ? bin < o.bin : number < o.number;
    }
  };
  std::vector<Key> keys(n);
  constexpr double kTurn = 6.283185307179586476925286766559;
  int64_t bin = 0;
  for (size_t k = 0; k < n; ++k) {
    const double *p = points.data() + 2 * k, *d = directions.data() + 2 * k;
    if (k == 0 || d[0] != d[-2] || d[1] != d[-1])  // not again for each sample of one sighting
      bin = static_cast<int64_t>(std::floor(std::atan2(d[1], d[0]) / kTurn * static_cast<double>(bins)));
    keys[k] = {static_cast<int64_t>(std::floor(p[0] / cell)), static_cast<int64_t>(std::floor(p[1] / cell)),
               ((bin % bins) + bins) % bins, k};
  }
  std::sort(keys.begin(), keys.end());
  std::vector<double> place, facing, total;
  for (size_t k = 0; k < n;) {
    double w = 0, sums[4] = {0, 0, 0, 0};
    const Key first = keys[k];
    for (; k < n && keys[k].i == first.i && keys[k].j == first.j && keys[k].bin == first.bin; ++k) {
      const size_t number = keys[k].number;
      const double weight = weights.data()[number];
      w += weight;
      for (int c = 0; c < 2; ++c) {
        sums[c] += weight * points.data()[2 * number + c];
        sums[2 + c] += weight * directions.data()[2 * number + c];
      }
    }
    const double u = sums[2] / w, v = sums[3] / w, length = std::hypot(u, v);
    place.insert(place.end(), {sums[0] / w, sums[1] / w});
    facing.insert(facing.end(), {u / length, v / length});
    total.push_back(w);
  }
  const size_t count = total.size();
  return std::make_tuple(give(std::move(place), {count, 2}), give(std::move(facing), {count, 2}),
                        give(std::move(total), {count}));
}

}  // namespace evidence

inline void bind_evidence(nb::module_& m) {
  m.def("near_pairs", &evidence::near_pairs, nb::arg("segments"), nb::arg("points"), nb::arg("directions"),
        nb::arg("reach"));
  m.def("take_greedily", &evidence::take_greedily, nb::arg("count"), nb::arg("segment"), nb::arg("sample"),
        nb::arg("explains"), nb::arg("weights"), nb::arg("price"));
  m.def("gather", &evidence::gather, nb::arg("points"), nb::arg("directions"), nb::arg("weights"), nb::arg("cell"),
        nb::arg("bins"));
}
