// What was seen near segments, and which segments to keep. Twins and words are in evidence.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

#include "arrays.hpp"
#include "grid.hpp"
#include "sampling.hpp"

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

// Which segments have a cell of a grid within reach, cell by cell and ascending in each.
struct Reaching {
  std::vector<int64_t> start, segment;
  Reaching(const Cells& cells, const double* segments, size_t count, double reach) : start(cells.count() + 1, 0) {
    for (size_t k = 0; k < count; ++k)
      cells.along(segments + 4 * k, reach, [&](int64_t first, int64_t last) {
        for (int64_t cell = first; cell <= last; ++cell) ++start[cell + 1];
      });
    for (size_t cell = 1; cell < start.size(); ++cell) start[cell] += start[cell - 1];
    segment.resize(static_cast<size_t>(start.back()));
    std::vector<int64_t> next(start.begin(), start.end() - 1);
    for (size_t k = 0; k < count; ++k)
      cells.along(segments + 4 * k, reach, [&](int64_t first, int64_t last) {
        for (int64_t cell = first; cell <= last; ++cell) segment[next[cell]++] = static_cast<int64_t>(k);
      });
  }
};

// A point near a segment: where it lies along and across it, and how far past its ends [m].
struct Near {
  int64_t segment, point;
  double along, across, beyond;
};

inline std::vector<Near> find_near(const std::vector<Line>& lines, const double* segments, const double* points,
                                   size_t count, double reach) {
  const Cells cells(points, count, std::max(reach, 0.1));
  std::vector<Near> pairs;
  if (!count) return pairs;
  const Reaching reaching(cells, segments, lines.size(), reach);
  for (size_t i = 0; i < count; ++i) {
    const double* point = points + 2 * i;
    const int64_t cell = cells.of(point);
    for (int64_t k = reaching.start[cell]; k < reaching.start[cell + 1]; ++k) {
      const Line& line = lines[static_cast<size_t>(reaching.segment[k])];
      const double dx = point[0] - line.x, dy = point[1] - line.y;
      const double a = line.u * dx + line.v * dy, c = line.u * dy - line.v * dx;
      const double beyond = line.beyond(dx, dy, a);
      if (c * c + beyond * beyond <= reach * reach)
        pairs.push_back({reaching.segment[k], static_cast<int64_t>(i), a, c, beyond});
    }
  }
  return pairs;
}

inline auto near_pairs(In<double, 2> segments, In<double, 2> points, In<double, 2> directions, double reach) {
  const size_t n = segments.shape(0), m = points.shape(0);
  if (segments.shape(1) != 4 || points.shape(1) != 2 || directions.shape(1) != 2 || directions.shape(0) != m)
    throw std::invalid_argument("segments (n, 4), points (m, 2), directions (m, 2) expected");
  if (!(reach > 0)) throw std::invalid_argument("reach: above 0 expected");
  for (size_t i = 0; i < 4 * n; ++i)
    if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
  std::vector<int64_t> segment, point;
  std::vector<double> along, across, distance, cosine;
  {
    const nb::gil_scoped_release others_go_on;
    std::vector<Line> lines;
    lines.reserve(n);
    for (size_t k = 0; k < n; ++k) lines.emplace_back(segments.data() + 4 * k);
    const std::vector<Near> pairs = find_near(lines, segments.data(), points.data(), m, reach);
    // They come point by point; each goes to the next place of its segment.
    std::vector<size_t> next(n + 1, 0);
    for (const Near& p : pairs) ++next[p.segment + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    for (auto* numbers : {&segment, &point}) numbers->resize(pairs.size());
    for (auto* numbers : {&along, &across, &distance, &cosine}) numbers->resize(pairs.size());
    for (const Near& p : pairs) {
      const size_t at = next[p.segment]++;
      const double* direction = directions.data() + 2 * p.point;
      const Line& line = lines[static_cast<size_t>(p.segment)];
      segment[at] = p.segment, point[at] = p.point, along[at] = p.along, across[at] = p.across;
      distance[at] = p.beyond > 0 ? std::hypot(p.across, p.beyond) : std::abs(p.across);
      cosine[at] = line.u * direction[0] + line.v * direction[1];
    }
  }
  const size_t k = segment.size();
  return std::make_tuple(give(std::move(segment), {k}), give(std::move(point), {k}), give(std::move(along), {k}),
                         give(std::move(across), {k}), give(std::move(distance), {k}), give(std::move(cosine), {k}));
}

// How much of one segment lies along another [m].
struct Shared {
  int64_t segment, other;
  double length;
  bool operator<(const Shared& o) const { return segment != o.segment ? segment < o.segment : other < o.other; }
};

// Adds what of the parts of one segment `own` lies along others; returns the share that does.
inline double cover(const sampling::Parts& own, const double* points, int64_t number, const std::vector<Line>& lines,
                    const Cells& cells, const Reaching& reaching, double reach, double least_cosine,
                    std::vector<Shared>& shared) {
  const size_t begin = shared.size();
  double all = 0, covered = 0;
  for (double rank = 0; rank < own.count; ++rank, points += 2) {
    bool is_covered = false;
    const int64_t cell = cells.of(points);
    for (int64_t k = reaching.start[cell]; k < reaching.start[cell + 1]; ++k) {
      const Line& line = lines[static_cast<size_t>(reaching.segment[k])];
      if (line.u * own.u + line.v * own.v < least_cosine) continue;
      const double dx = points[0] - line.x, dy = points[1] - line.y;
      const double a = line.u * dx + line.v * dy, c = line.u * dy - line.v * dx;
      const double beyond = line.beyond(dx, dy, a);
      if (!(c * c + beyond * beyond <= reach * reach)) continue;
      is_covered = true;
      auto known = shared.begin() + static_cast<std::ptrdiff_t>(begin);
      while (known != shared.end() && known->segment != reaching.segment[k]) ++known;
      if (known == shared.end()) known = shared.insert(known, {reaching.segment[k], number, 0.0});
      known->length += own.part;
    }
    all += own.part;
    if (is_covered) covered += own.part;
  }
  return all > 0 ? covered / all : 1.0;
}

inline auto find_shared(In<double, 2> segments, In<double, 2> others, double spacing, double reach,
                        double least_cosine) {
  const size_t n = segments.shape(0), m = others.shape(0);
  if (segments.shape(1) != 4) throw std::invalid_argument("segments (n, 4) expected");
  if (!(reach > 0)) throw std::invalid_argument("reach: above 0 expected");
  for (size_t i = 0; i < 4 * n; ++i)
    if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
  const std::vector<sampling::Parts> parts = sampling::parts_of(others, spacing);
  std::vector<Shared> shared;
  std::vector<double> covered(m);
  {
    const nb::gil_scoped_release others_go_on;
    const std::vector<double> points = sampling::middles_of(parts);
    std::vector<Line> lines;
    lines.reserve(n);
    for (size_t k = 0; k < n; ++k) lines.emplace_back(segments.data() + 4 * k);
    const Cells cells(points.data(), points.size() / 2, std::max(reach, 0.1));
    const Reaching reaching(cells, segments.data(), n, reach);
    const double* at = points.data();
    for (size_t k = 0; k < m; ++k) {
      covered[k] = cover(parts[k], at, static_cast<int64_t>(k), lines, cells, reaching, reach, least_cosine, shared);
      at += 2 * static_cast<size_t>(parts[k].count);
    }
    std::sort(shared.begin(), shared.end());
  }
  const auto number = [&](auto&& of) {
    std::vector<int64_t> numbers(shared.size());
    std::transform(shared.begin(), shared.end(), numbers.begin(), of);
    return give(std::move(numbers), {shared.size()});
  };
  std::vector<double> length(shared.size());
  std::transform(shared.begin(), shared.end(), length.begin(), [](const Shared& s) { return s.length; });
  return std::make_tuple(number([](const Shared& s) { return s.segment; }),
                         number([](const Shared& s) { return s.other; }), give(std::move(length), {shared.size()}),
                         give(std::move(covered), {m}));
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

// Samples in one cell and of one direction: their weight, and weighted sums of places and directions.
struct Group {
  int64_t i, j, bin;
  double weight, sums[4];

  bool is(const Group& o) const { return i == o.i && j == o.j && bin == o.bin; }
  bool operator<(const Group& o) const { return i != o.i ? i < o.i : j != o.j ? j < o.j : bin < o.bin; }
  size_t hash() const {
    const uint64_t mixed = (static_cast<uint64_t>(i) * 0x9E3779B97F4A7C15u ^ static_cast<uint64_t>(j)) * 0xC2B2AE3D27D4EB4Fu;
    return static_cast<size_t>((mixed ^ static_cast<uint64_t>(bin)) * 0x9E3779B97F4A7C15u >> 20);
  }
};

// Groups as they come, to be found again: a table of their numbers, at most half full.
class Groups {
 public:
  std::vector<Group> all;

  // The group that is where `wanted` is, added if there is none.
  Group& find(const Group& wanted) {
    size_t at = place_of(wanted);
    if (table_[at] == kNone) {
      if (2 * all.size() >= table_.size()) grow(), at = place_of(wanted);
      table_[at] = static_cast<int64_t>(all.size());
      all.push_back(wanted);
    }
    return all[static_cast<size_t>(table_[at])];
  }

 private:
  static constexpr int64_t kNone = -1;
  std::vector<int64_t> table_ = std::vector<int64_t>(1024, kNone);

  size_t place_of(const Group& wanted) const {
    size_t at = wanted.hash() & (table_.size() - 1);
    while (table_[at] != kNone && !all[static_cast<size_t>(table_[at])].is(wanted)) at = (at + 1) & (table_.size() - 1);
    return at;
  }

  void grow() {
    table_.assign(2 * table_.size(), kNone);
    for (size_t k = 0; k < all.size(); ++k) table_[place_of(all[k])] = static_cast<int64_t>(k);
  }
};

inline std::vector<Group> find_groups(const double* points, const double* directions, const double* weights,
                                      size_t count, double cell, int64_t bins) {
  constexpr double kTurn = 6.283185307179586476925286766559;
  Groups groups;
  int64_t bin = 0;
  for (size_t k = 0; k < count; ++k) {
    const double *p = points + 2 * k, *d = directions + 2 * k, weight = weights[k];
    if (k == 0 || d[0] != d[-2] || d[1] != d[-1])  // not again for each sample of one sighting
      bin = static_cast<int64_t>(std::floor(std::atan2(d[1], d[0]) / kTurn * static_cast<double>(bins)));
    Group& group = groups.find({floor_of(p[0] / cell), floor_of(p[1] / cell), ((bin % bins) + bins) % bins, 0, {}});
    group.weight += weight;
    for (int c = 0; c < 2; ++c) group.sums[c] += weight * p[c], group.sums[2 + c] += weight * d[c];
  }
  std::sort(groups.all.begin(), groups.all.end());
  return std::move(groups.all);
}

inline auto gather(In<double, 2> points, In<double, 2> directions, In<double, 1> weights, double cell, int64_t bins) {
  const size_t n = points.shape(0);
  if (points.shape(1) != 2 || directions.shape(1) != 2 || directions.shape(0) != n || weights.shape(0) != n)
    throw std::invalid_argument("points (n, 2), directions (n, 2), weights (n,) expected");
  std::vector<double> place, facing, total;
  {
    const nb::gil_scoped_release others_go_on;
    for (const Group& g : find_groups(points.data(), directions.data(), weights.data(), n, cell, bins)) {
      const double u = g.sums[2] / g.weight, v = g.sums[3] / g.weight, length = std::hypot(u, v);
      place.insert(place.end(), {g.sums[0] / g.weight, g.sums[1] / g.weight});
      facing.insert(facing.end(), {u / length, v / length});
      total.push_back(g.weight);
    }
  }
  const size_t count = total.size();
  return std::make_tuple(give(std::move(place), {count, 2}), give(std::move(facing), {count, 2}),
                         give(std::move(total), {count}));
}

}  // namespace evidence

inline void bind_evidence(nb::module_& m) {
  m.def("near_pairs", &evidence::near_pairs, nb::arg("segments"), nb::arg("points"), nb::arg("directions"),
        nb::arg("reach"));
  m.def("find_shared", &evidence::find_shared, nb::arg("segments"), nb::arg("others"), nb::arg("spacing"),
        nb::arg("reach"), nb::arg("least_cosine"));
  m.def("take_greedily", &evidence::take_greedily, nb::arg("count"), nb::arg("segment"), nb::arg("sample"),
        nb::arg("explains"), nb::arg("weights"), nb::arg("price"));
  m.def("gather", &evidence::gather, nb::arg("points"), nb::arg("directions"), nb::arg("weights"), nb::arg("cell"),
        nb::arg("bins"));
}
