// What proposes transforms between two maps. The twins and the words are in matching/corners.py, windows.py
// and distinct.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"
#include "motions.hpp"

namespace proposals {

using motions::kHalfTurn;
using motions::kTurn;
using motions::wrap;

constexpr double kRounding = 1e-9;  // by which a square root may differ from hypot, amply

// Pairs of walls, each a corner: their numbers, and the angle from the first's direction to the second's.
inline std::tuple<Out<int64_t>, Out<int64_t>, Out<double>> corner_pairs(In<double, 2> walls, double max_gap,
                                                                        double min_angle) {
  if (walls.shape(1) != 4) throw std::invalid_argument("walls: (n, 4) expected");
  const size_t n = walls.shape(0);
  std::vector<double> direction(n);
  for (size_t k = 0; k < n; ++k)
    direction[k] = std::atan2(walls(k, 3) - walls(k, 1), walls(k, 2) - walls(k, 0));
  const double least = std::sin(min_angle);
  std::vector<int64_t> first, second;
  std::vector<double> angles;
  for (size_t i = 0; i < n; ++i)
    for (size_t j = 0; j < n; ++j) {
      const double *a = walls.data() + 4 * i, *b = walls.data() + 4 * j;
      double squared = std::numeric_limits<double>::infinity();
      for (int e = 0; e < 4; e += 2)
        for (int f = 0; f < 4; f += 2) {
          const double x = a[e] - b[f], y = a[e + 1] - b[f + 1];
          squared = std::min(squared, x * x + y * y);
        }
      if (!(std::sqrt(squared) <= max_gap)) continue;
      const double angle = wrap(direction[j] - direction[i]);
      if (!(angle > 0 && std::abs(std::sin(angle)) >= least)) continue;
      first.push_back(static_cast<int64_t>(i));
      second.push_back(static_cast<int64_t>(j));
      angles.push_back(angle);
    }
  const size_t m = first.size();
  return {give(std::move(first), {m}), give(std::move(second), {m}), give(std::move(angles), {m})};
}

// Proposals that agree, counted in a cell.
struct Cell {
  std::array<int32_t, 3> key;
  double votes, x, y, cosine, sine;
};

// Cells by their key, in a table that grows.
class Ballot {
 public:
  Ballot() : places_(1 << 12, -1) {}

  Cell& at(const std::array<int32_t, 3>& key) {
    if (2 * cells_.size() >= places_.size()) grow();
    size_t place = spot(key);
    while (places_[place] >= 0) {
      Cell& cell = cells_[places_[place]];
      if (cell.key == key) return cell;
      place = (place + 1) & (places_.size() - 1);
    }
    places_[place] = static_cast<int32_t>(cells_.size());
    cells_.push_back({key, 0, 0, 0, 0, 0});
    return cells_.back();
  }

  std::vector<Cell>& cells() { return cells_; }

 private:
  size_t spot(const std::array<int32_t, 3>& key) const {
    uint64_t mixed = 0;
    for (const int32_t k : key) mixed = (mixed ^ static_cast<uint32_t>(k)) * 0x9E3779B97F4A7C15ull;
    return static_cast<size_t>(mixed >> 20) & (places_.size() - 1);
  }

  void grow() {
    places_.assign(2 * places_.size(), -1);
    for (size_t k = 0; k < cells_.size(); ++k) {
      size_t place = spot(cells_[k].key);
      while (places_[place] >= 0) place = (place + 1) & (places_.size() - 1);
      places_[place] = static_cast<int32_t>(k);
    }
  }

  std::vector<int32_t> places_;
  std::vector<Cell> cells_;
};

inline void check_corners(In<double, 2> frame, In<double, 1> angle, In<double, 1> weight) {
  if (frame.shape(1) != 3 || angle.shape(0) != frame.shape(0) || weight.shape(0) != frame.shape(0))
    throw std::invalid_argument("frame (k, 3), angle (k,) and weight (k,) expected");
  for (size_t k = 0; k < frame.size(); ++k)
    if (!(std::abs(frame.data()[k]) < 1e6)) throw std::invalid_argument("frame: numbers below 1e6 expected");
}

// The most proposed transforms that lay corners on like corners, the mean of each cell.
inline Out<double> most_proposed(In<double, 2> frame, In<double, 1> angle, In<double, 1> weight,
                                 In<double, 2> other_frame, In<double, 1> other_angle, In<double, 1> other_weight,
                                 double tolerance, double vote_cell, double vote_turn, int64_t count) {
  check_corners(frame, angle, weight);
  check_corners(other_frame, other_angle, other_weight);
  if (!(vote_cell >= 1e-3 && vote_turn > 1e-6 && vote_turn <= kTurn && count >= 0))
    throw std::invalid_argument("vote_cell >= 1e-3, vote_turn in (0, 2 pi], count >= 0 expected");
  const int32_t turns = static_cast<int32_t>(std::nearbyint(kTurn / vote_turn));
  const size_t m = other_frame.shape(0);
  std::vector<double> cosine(m), sine(m);
  for (size_t j = 0; j < m; ++j) {
    const double half = other_frame(j, 2) + 0.5 * other_angle(j);
    cosine[j] = std::cos(half);
    sine[j] = std::sin(half);
  }
  Ballot ballot;
  for (size_t i = 0; i < frame.shape(0); ++i) {
    const double half = frame(i, 2) + 0.5 * angle(i), ci = std::cos(half), si = std::sin(half);
    for (size_t j = 0; j < m; ++j) {
      double apart = angle(i) - other_angle(j);
      const bool around = std::abs(apart) > kHalfTurn;  // then half of it is half a turn off
      if (around) apart = wrap(apart);
      if (!(std::abs(apart) <= tolerance)) continue;
      const double sign = around ? -1.0 : 1.0;
      const double c = sign * (ci * cosine[j] + si * sine[j]), s = sign * (si * cosine[j] - ci * sine[j]);
      const double turn = frame(i, 2) - other_frame(j, 2) + 0.5 * apart;
      const double x = frame(i, 0) - c * other_frame(j, 0) + s * other_frame(j, 1);
      const double y = frame(i, 1) - s * other_frame(j, 0) - c * other_frame(j, 1);
      const double rounds = (turn + kHalfTurn) / kTurn, share = (rounds - std::floor(rounds)) * turns;
      Cell& cell = ballot.at({static_cast<int32_t>(std::floor(x / vote_cell)),
                              static_cast<int32_t>(std::floor(y / vote_cell)),
                              static_cast<int32_t>(share) % turns});
      const double w = std::min(weight(i), other_weight(j));
      cell.votes += w;
      cell.x += w * x;
      cell.y += w * y;
      cell.cosine += w * c;
      cell.sine += w * s;
    }
  }
  std::vector<Cell>& cells = ballot.cells();
  const size_t kept = std::min(cells.size(), static_cast<size_t>(count));
  std::partial_sort(cells.begin(), cells.begin() + kept, cells.end(), [](const Cell& a, const Cell& b) {
    return a.votes != b.votes ? a.votes > b.votes : a.key < b.key;
  });
  std::vector<double> found;
  for (size_t k = 0; k < kept; ++k) {
    const Cell& c = cells[k];
    found.insert(found.end(), {c.x / c.votes, c.y / c.votes, std::atan2(c.sine, c.cosine)});
  }
  return give(std::move(found), {kept, 3});
}

struct Peaks {
  std::vector<int64_t> row, column;
  std::vector<double> gain, similarity, transform, residual;
};

// The rigid motion from samples `b` to `a` at a given rotation, and the rms distance after it.
inline void fit(const double* a, const double* b, size_t samples, double rotation, Peaks& peaks) {
  const double c = std::cos(rotation), s = std::sin(rotation);
  double x = 0, y = 0, squares = 0;
  for (size_t k = 0; k < samples; ++k) {
    x += a[2 * k] - (c * b[2 * k] - s * b[2 * k + 1]);
    y += a[2 * k + 1] - (s * b[2 * k] + c * b[2 * k + 1]);
  }
  x /= static_cast<double>(samples);
  y /= static_cast<double>(samples);
  for (size_t k = 0; k < samples; ++k) {
    const double dx = a[2 * k] - (c * b[2 * k] - s * b[2 * k + 1]) - x;
    const double dy = a[2 * k + 1] - (s * b[2 * k] + c * b[2 * k + 1]) - y;
    squares += dx * dx + dy * dy;
  }
  peaks.transform.insert(peaks.transform.end(), {x, y, rotation});
  peaks.residual.push_back(std::sqrt(squares / static_cast<double>(samples)));
}

// The squared similarities of a row of pairs; -1 for those that are too little alike, most of them: without a root.
MAPWEAVE_WIDE inline void square(double* __restrict squared, const double* __restrict product, double straight,
                                 const double* __restrict others, double least, double min_gain, size_t count) {
  for (size_t j = 0; j < count; ++j) {
    const double re = product[2 * j], im = product[2 * j + 1], sum = re * re + im * im;
    const double more = std::max(straight, others[j]) + min_gain - 2 * kRounding, bound = std::max(more, 0.0);
    squared[j] = (sum >= least) & (sum >= bound * bound) ? sum : -1.0;
  }
}

inline std::tuple<Out<int64_t>, Out<int64_t>, Out<double>, Out<double>, Out<double>, Out<double>> alike_windows(
    In<double, 3> product, In<double, 1> straight, In<double, 1> other_straight, In<int64_t, 1> place,
    In<int64_t, 1> other_place, In<double, 3> points, In<double, 3> other_points, double min_similarity,
    double min_gain) {
  const size_t rows = product.shape(0), columns = product.shape(1);
  if (product.shape(2) != 2 || straight.shape(0) != rows || place.shape(0) != rows || points.shape(0) != rows ||
      other_straight.shape(0) != columns || other_place.shape(0) != columns || other_points.shape(0) != columns ||
      points.shape(2) != 2 || other_points.shape(2) != 2 || points.shape(1) != other_points.shape(1) ||
      points.shape(1) == 0)
    throw std::invalid_argument("of rows and columns of product (r, c, 2): straightness, place, points expected");
  constexpr double kOut = -std::numeric_limits<double>::infinity();
  const double least = min_similarity * min_similarity;
  std::vector<double> gain(rows * columns, kOut);
  std::vector<size_t> found;
  std::vector<double> squared(columns);
  for (size_t i = 0; i < rows; ++i) {
    const double* row = product.data() + 2 * i * columns;
    square(squared.data(), row, straight(i), other_straight.data(), least, min_gain, columns);
    for (size_t j = 0; j < columns; ++j) {
      if (!(squared[j] >= 0)) continue;
      const double similarity = std::min(std::hypot(row[2 * j], row[2 * j + 1]), 1.0);
      const double more = similarity - std::max(straight(i), other_straight(j));
      if (!(more > min_gain)) continue;
      gain[i * columns + j] = std::nearbyint(more * 1e9) / 1e9;
      found.push_back(i * columns + j);
    }
  }
  const auto beside = [&](size_t i, size_t j, int down, int right) {
    const size_t r = i + down, c = j + right;  // wraps below 0: then it is beyond the last as well
    if (r >= rows || c >= columns || place(r) != place(i) + down || other_place(c) != other_place(j) + right)
      return kOut;
    return gain[r * columns + c];
  };
  Peaks peaks;
  for (const size_t at : found) {
    const size_t i = at / columns, j = at % columns;
    bool highest = true;
    for (int down = -1; down <= 1 && highest; ++down)
      for (int right = -1; right <= 1 && highest; ++right) {
        if (down == 0 && right == 0) continue;
        const bool before = down < 0 || (down == 0 && right < 0);
        const double near = beside(i, j, down, right);
        highest = before ? gain[at] > near : gain[at] >= near;
      }
    if (!highest) continue;
    const double re = product(i, j, 0), im = product(i, j, 1);
    peaks.row.push_back(static_cast<int64_t>(i));
    peaks.column.push_back(static_cast<int64_t>(j));
    peaks.gain.push_back(gain[at]);
    peaks.similarity.push_back(std::min(std::hypot(re, im), 1.0));
    const size_t samples = points.shape(1);
    fit(points.data() + 2 * samples * i, other_points.data() + 2 * samples * j, samples, std::atan2(im, re), peaks);
  }
  const size_t n = peaks.row.size();
  return {give(std::move(peaks.row), {n}),        give(std::move(peaks.column), {n}),
          give(std::move(peaks.gain), {n}),       give(std::move(peaks.similarity), {n}),
          give(std::move(peaks.transform), {n, 3}), give(std::move(peaks.residual), {n})};
}

// Numbers of the best, each different from the better ones at `middle`.
inline Out<int64_t> distinct(In<double, 2> transforms, In<double, 1> scores, In<double, 1> middle, int64_t count,
                             double distance, double angle) {
  const size_t n = scores.shape(0);
  if (transforms.shape(0) != n || transforms.shape(1) != 3 || middle.shape(0) != 2)
    throw std::invalid_argument("transforms (n, 3), scores (n,), middle (2,) expected");
  for (size_t k = 0; k < n; ++k)
    if (std::isnan(scores(k))) throw std::invalid_argument("scores: numbers expected");
  std::vector<int64_t> heap(n), kept;
  std::vector<motions::Motion> there;  // where those kept put the middle
  std::iota(heap.begin(), heap.end(), 0);
  const auto worse = [&](int64_t a, int64_t b) { return scores(a) != scores(b) ? scores(a) < scores(b) : a > b; };
  std::make_heap(heap.begin(), heap.end(), worse);
  while (!heap.empty() && static_cast<int64_t>(kept.size()) < count) {
    std::pop_heap(heap.begin(), heap.end(), worse);
    const int64_t k = heap.back();
    heap.pop_back();
    const double turn = transforms(k, 2), c = std::cos(turn), s = std::sin(turn);
    const motions::Motion here{transforms(k, 0) + (c * middle(0) - s * middle(1)),
                               transforms(k, 1) + (s * middle(0) + c * middle(1)), turn};
    const bool differs = std::all_of(there.begin(), there.end(), [&](const motions::Motion& o) {
      return std::hypot(here.x - o.x, here.y - o.y) > distance || std::abs(wrap(here.theta - o.theta)) > angle;
    });
    if (differs) kept.push_back(k), there.push_back(here);
  }
  const size_t m = kept.size();
  return give(std::move(kept), {m});
}

}  // namespace proposals

inline void bind_proposals(nb::module_& m) {
  m.def("corner_pairs", &proposals::corner_pairs, nb::arg("walls"), nb::arg("max_gap"), nb::arg("min_angle"));
  m.def("most_proposed", &proposals::most_proposed, nb::arg("frame"), nb::arg("angle"), nb::arg("weight"),
        nb::arg("other_frame"), nb::arg("other_angle"), nb::arg("other_weight"), nb::arg("tolerance"),
        nb::arg("vote_cell"), nb::arg("vote_turn"), nb::arg("count"));
  m.def("alike_windows", &proposals::alike_windows, nb::arg("product"), nb::arg("straight"),
        nb::arg("other_straight"), nb::arg("place"), nb::arg("other_place"), nb::arg("points"),
        nb::arg("other_points"), nb::arg("min_similarity"), nb::arg("min_gain"));
  m.def("distinct", &proposals::distinct, nb::arg("transforms"), nb::arg("scores"), nb::arg("middle"),
        nb::arg("count"), nb::arg("distance"), nb::arg("angle"));
}
