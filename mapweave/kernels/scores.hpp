// What samples find at many transforms, in single precision. The twin and the words are in scores.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "motions.hpp"

namespace scores {

constexpr double kTurns = 4;  // added to directions, so that turned ones are above 0

// A map: samples of its walls, and what its cells say.
struct Map {
  In<double, 2> points;
  In<double, 1> facing, weight, missing, origin;
  double cell;
  In<uint8_t, 2> codes;

  void check(size_t said) const {
    const size_t n = points.shape(0);
    if (points.shape(1) != 2 || facing.shape(0) != n || weight.shape(0) != n || missing.shape(0) != n)
      throw std::invalid_argument("points (n, 2), facing, weight and missing (n,) expected");
    if (origin.shape(0) != 2 || !(cell > 0) || codes.shape(0) < 1 || codes.shape(1) < 1)
      throw std::invalid_argument("origin (2,), cell above 0, codes of a cell or more expected");
    uint8_t most = 0;
    for (size_t at = 0; at < codes.size(); ++at) most = std::max(most, codes.data()[at]);
    if (most >= said) throw std::invalid_argument("codes: rows of worth expected");
  }
};

// A sample as it is looked up: its place [cells], its direction, and what a metre of it counts, found or missed [m].
struct Sample {
  float x, y, direction;
  double found, missed;
};

// So many samples at the most, each of which stands for those between.
inline std::vector<Sample> samples_of(const Map& map, size_t most, double cell, double directions) {
  const size_t n = map.weight.shape(0), stride = n > most ? 1 + (n - 1) / most : 1;
  double all = 0, few = 0;
  for (size_t k = 0; k < n; ++k) all += map.weight(k);
  for (size_t k = 0; k < n; k += stride) few += map.weight(k);
  std::vector<Sample> samples;
  samples.reserve(n / stride + 1);
  for (size_t k = 0; k < n; k += stride) {
    const double metres = map.weight(k) * (all / std::max(few, 1e-300));
    samples.push_back({static_cast<float>(map.points(k, 0) / cell), static_cast<float>(map.points(k, 1) / cell),
                       static_cast<float>((map.facing(k) + kTurns) * directions), metres, metres * map.missing(k)});
  }
  return samples;
}

// What the walls of `other` are worth in `map`, where `motion` lays them; `c` and `s` are of its turn.
inline double worth_of(const std::vector<Sample>& other, const Map& map, const motions::Motion& motion, float c, float s,
                       In<float, 2> worth) {
  const int64_t columns = static_cast<int64_t>(map.codes.shape(1));
  const float last_row = static_cast<float>(map.codes.shape(0) - 1), last_column = static_cast<float>(columns - 1);
  const int64_t directions = static_cast<int64_t>(worth.shape(1));
  const int32_t mask = static_cast<int32_t>(directions - 1);
  const float x0 = static_cast<float>((motion.x - map.origin(0)) / map.cell);
  const float y0 = static_cast<float>((motion.y - map.origin(1)) / map.cell);
  const float turn =
      static_cast<float>(motion.theta) * static_cast<float>(static_cast<double>(directions) / motions::kTurn);
  double sum = 0;
  for (const Sample& p : other) {
    const float x = c * p.x - s * p.y + x0, y = s * p.x + c * p.y + y0;
    const int64_t row = static_cast<int64_t>(x > 0 ? std::min(x, last_row) : 0.0f);
    const int64_t column = static_cast<int64_t>(y > 0 ? std::min(y, last_column) : 0.0f);
    const int32_t direction = static_cast<int32_t>(p.direction + turn) & mask;
    const double counts = worth.data()[map.codes.data()[row * columns + column] * directions + direction];
    sum += counts * (counts < 0 ? p.missed : p.found);
  }
  return sum;
}

inline Out<double> mutual_scores(In<double, 2> points, In<double, 1> facing, In<double, 1> weight,
                                 In<double, 1> missing, In<double, 1> origin, double cell, In<uint8_t, 2> codes,
                                 In<double, 2> other_points, In<double, 1> other_facing, In<double, 1> other_weight,
                                 In<double, 1> other_missing, In<double, 1> other_origin, double other_cell,
                                 In<uint8_t, 2> other_codes, In<double, 2> transforms, int64_t most,
                                 In<float, 2> worth) {
  const Map map{points, facing, weight, missing, origin, cell, codes};
  const Map other{other_points, other_facing, other_weight, other_missing, other_origin, other_cell, other_codes};
  const size_t directions = worth.shape(1), k = transforms.shape(0);
  if (directions < 1 || (directions & (directions - 1)))
    throw std::invalid_argument("directions: a power of two expected");
  if (transforms.shape(1) != 3 || most < 1) throw std::invalid_argument("transforms (k, 3), most >= 1 expected");
  map.check(worth.shape(0)), other.check(worth.shape(0));
  const auto ours = samples_of(map, static_cast<size_t>(most), other.cell, static_cast<double>(directions));
  const auto theirs = samples_of(other, static_cast<size_t>(most), map.cell, static_cast<double>(directions));
  std::vector<double> sums(k);
  for (size_t t = 0; t < k; ++t) {
    const motions::Motion there{transforms(t, 0), transforms(t, 1), transforms(t, 2)};
    const double angle = static_cast<float>(there.theta);
    const float c = static_cast<float>(std::cos(angle)), s = static_cast<float>(std::sin(angle));
    const double forward = worth_of(theirs, map, there, c, s, worth);
    sums[t] = (forward + worth_of(ours, other, there.inverse(), c, -s, worth)) / 2;
  }
  return give(std::move(sums), {k});
}

}  // namespace scores

inline void bind_scores(nb::module_& m) {
  m.def("mutual_scores", &scores::mutual_scores, nb::arg("points"), nb::arg("facing"), nb::arg("weight"),
        nb::arg("missing"), nb::arg("origin"), nb::arg("cell"), nb::arg("codes"), nb::arg("other_points"),
        nb::arg("other_facing"), nb::arg("other_weight"), nb::arg("other_missing"), nb::arg("other_origin"),
        nb::arg("other_cell"), nb::arg("other_codes"), nb::arg("transforms"), nb::arg("most"), nb::arg("worth"));
}
