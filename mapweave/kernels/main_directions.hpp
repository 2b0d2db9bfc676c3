// Main directions: significant peaks of the direction histogram (paper, VI-A).
// The twin and the words are in main_directions.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"
#include "motions.hpp"

namespace main_directions {

constexpr double kPeriod = 3.141592653589793238462643383280;  // of the directions of lines [rad]

struct Rules {
  int64_t bins;
  double smoothing, significance, separation;

  static Rules of(nb::handle given) {
    return {nb::cast<int64_t>(given.attr("bins")), nb::cast<double>(given.attr("smoothing")),
            nb::cast<double>(given.attr("significance")), nb::cast<double>(given.attr("separation"))};
  }
};

// From line direction `second` to `first` [rad], in [-pi/2, pi/2).
inline double line_difference(double first, double second) {
  const double turn = first - second + kPeriod / 2;
  return turn - kPeriod * std::floor(turn / kPeriod) - kPeriod / 2;
}

inline std::vector<double> smoothed(const std::vector<double>& raw, double sigma) {
  const int64_t bins = static_cast<int64_t>(raw.size());
  const int64_t radius = static_cast<int64_t>(4.0 * sigma + 0.5);
  std::vector<double> tap(radius + 1);
  double sum = 0.0;
  for (int64_t k = 0; k <= radius; ++k) tap[k] = std::exp(-0.5 / (sigma * sigma) * static_cast<double>(k * k));
  for (int64_t k = -radius; k <= radius; ++k) sum += tap[std::abs(k)];
  for (double& each : tap) each /= sum;
  const auto at = [&](int64_t i) { return raw[static_cast<size_t>(((i % bins) + bins) % bins)]; };
  std::vector<double> smooth(raw.size());
  for (int64_t i = 0; i < bins; ++i) {
    double value = raw[i] * tap[0];
    for (int64_t k = radius; k >= 1; --k) {
      const bool inside = i >= k && i + k < bins;
      value += (inside ? raw[i - k] + raw[i + k] : at(i - k) + at(i + k)) * tap[k];
    }
    smooth[i] = value;
  }
  return smooth;
}

// How far a peak stands above the higher one of the valleys beside it.
inline double prominence(const std::vector<double>& around, int64_t peak) {
  const int64_t count = static_cast<int64_t>(around.size());
  double left = around[peak], right = around[peak];
  for (int64_t i = peak; i >= 0 && around[i] <= around[peak]; --i) left = std::min(left, around[i]);
  for (int64_t i = peak; i < count && around[i] <= around[peak]; ++i) right = std::min(right, around[i]);
  return around[peak] - std::max(left, right);
}

// The bins that stand out of the level of a uniform histogram and of their valleys.
inline std::vector<int64_t> significant_peaks(const std::vector<double>& histogram, const Rules& rules) {
  const int64_t bins = static_cast<int64_t>(histogram.size());
  std::vector<double> around;
  for (int k = 0; k < 3; ++k) around.insert(around.end(), histogram.begin(), histogram.end());
  double total = 0.0;
  for (const double each : histogram) total += each;
  const double height = rules.significance * (total / static_cast<double>(bins));
  std::vector<int64_t> peaks;
  for (int64_t i = 1; i + 1 < 3 * bins; ++i) {
    if (!(around[i - 1] < around[i])) continue;
    int64_t last = i;
    while (last + 1 < 3 * bins && around[last + 1] == around[i]) ++last;
    const int64_t peak = (i + last) / 2;
    if (last + 1 < 3 * bins && around[last + 1] < around[i] && peak >= bins && peak < 2 * bins &&
        around[peak] >= height && prominence(around, peak) >= rules.separation * around[peak])
      peaks.push_back(peak - bins);
    i = last;
  }
  return peaks;
}

// What counts for each bin, of `period` in all, smoothed.
inline std::vector<double> histogram_of(const std::vector<double>& angles, const double* mass, int64_t bins,
                                        double period, double smoothing) {
  std::vector<double> raw(static_cast<size_t>(bins), 0.0);
  for (size_t i = 0; i < angles.size(); ++i) {
    const int64_t bin = static_cast<int64_t>(std::nearbyint(angles[i] * static_cast<double>(bins) / period));
    raw[static_cast<size_t>((bin % bins + bins) % bins)] += mass[i];
  }
  return smoothed(raw, smoothing * static_cast<double>(bins) / period);
}

// Ascending, in [0, pi); `angles` [rad] count with their `mass`.
inline std::vector<double> find(const std::vector<double>& angles, const std::vector<double>& mass, const Rules& rules) {
  const std::vector<double> histogram = histogram_of(angles, mass.data(), rules.bins, kPeriod, rules.smoothing);
  std::vector<double> directions;
  if (std::all_of(histogram.begin(), histogram.end(), [](double each) { return each == 0.0; })) return directions;
  for (const int64_t bin : significant_peaks(histogram, rules)) {
    const double peak = static_cast<double>(bin) * kPeriod / static_cast<double>(rules.bins);
    double sum = 0.0, near = 0.0;
    for (size_t i = 0; i < angles.size(); ++i) {
      const double turn = line_difference(angles[i], peak);
      if (std::abs(turn) <= 2 * rules.smoothing) sum += mass[i] * turn, near += mass[i];
    }
    const double fine = near > 0 ? peak + sum / near : peak;
    directions.push_back(fine - kPeriod * std::floor(fine / kPeriod));
  }
  std::sort(directions.begin(), directions.end());
  return directions;
}

inline std::vector<double> angles_of(In<double, 2> segments, In<double, 1> weights) {
  const size_t n = segments.shape(0);
  if (segments.shape(1) != 4 || weights.shape(0) != n)
    throw std::invalid_argument("segments: (n, 4), weights: (n,) expected");
  std::vector<double> angles(n);
  for (size_t i = 0; i < n; ++i) {
    const double* s = segments.data() + 4 * i;
    angles[i] = std::atan2(s[3] - s[1], s[2] - s[0]);
    if (!std::isfinite(angles[i])) throw std::invalid_argument("segments: finite numbers expected");
  }
  return angles;
}

inline Out<double> histogram(In<double, 2> segments, In<double, 1> weights, int64_t bins, double period,
                             double smoothing) {
  if (!(bins >= 1 && bins <= 100'000 && period > 0 && smoothing > 0 && smoothing <= period))
    throw std::invalid_argument("bins, period, smoothing: > 0, and no more than a period expected");
  std::vector<double> found = histogram_of(angles_of(segments, weights), weights.data(), bins, period, smoothing);
  return give(std::move(found), {static_cast<size_t>(bins)});
}

// How much wall is parallel at each turn of the other map, by whole bins: the histograms' circular correlation.
inline std::vector<double> parallel(In<double, 1> reference, In<double, 1> other) {
  const size_t bins = reference.shape(0);
  std::vector<double> twice(reference.data(), reference.data() + bins), sums(bins, 0.0);
  twice.insert(twice.end(), reference.data(), reference.data() + bins);
  for (size_t i = 0; i < bins; ++i) {
    const double mass = other(i), *from = twice.data() + i;
    if (mass == 0.0) continue;
    for (size_t k = 0; k < bins; ++k) sums[k] += mass * from[k];
  }
  return sums;
}

// The turns, in [-pi, pi), at which most wall is parallel, the likeliest first.
inline Out<double> likely_turns(In<double, 1> reference, In<double, 1> other, int64_t count, double separation,
                                double least) {
  const size_t bins = reference.shape(0);
  if (bins < 1 || other.shape(0) != bins) throw std::invalid_argument("histograms of as many bins expected");
  const std::vector<double> likely = parallel(reference, other);
  const double height = least * *std::max_element(likely.begin(), likely.end());
  std::vector<size_t> peaks;
  for (size_t k = 0; k < bins; ++k)
    if (likely[k] >= likely[(k + bins - 1) % bins] && likely[k] > likely[(k + 1) % bins] && likely[k] >= height)
      peaks.push_back(k);
  std::stable_sort(peaks.begin(), peaks.end(), [&](size_t a, size_t b) { return likely[a] > likely[b]; });
  std::vector<double> kept;
  const double apart = std::cos(separation);
  for (const size_t peak : peaks) {
    if (static_cast<int64_t>(kept.size()) >= count) break;
    double turn = static_cast<double>(peak) * motions::kTurn / static_cast<double>(bins);
    turn = std::fmod(turn + kPeriod, motions::kTurn) - kPeriod;
    if (std::all_of(kept.begin(), kept.end(), [&](double each) { return std::cos(turn - each) < apart; }))
      kept.push_back(turn);
  }
  const size_t n = kept.size();
  return give(std::move(kept), {n});
}

inline Out<double> of_segments(In<double, 2> segments, In<double, 1> weights, nb::handle given) {
  const Rules rules = Rules::of(given);
  if (!(rules.bins >= 1 && rules.smoothing > 0)) throw std::invalid_argument("bins, smoothing: > 0 expected");
  const std::vector<double> angles = angles_of(segments, weights);
  const size_t n = angles.size();
  std::vector<double> found = find(angles, std::vector<double>(weights.data(), weights.data() + n), rules);
  const size_t count = found.size();
  return give(std::move(found), {count});
}

}  // namespace main_directions

inline void bind_main_directions(nb::module_& m) {
  m.def("main_directions", &main_directions::of_segments, nb::arg("segments"), nb::arg("weights"), nb::arg("rules"));
  m.def("direction_histogram", &main_directions::histogram, nb::arg("segments"), nb::arg("weights"), nb::arg("bins"),
        nb::arg("period"), nb::arg("smoothing"));
  m.def("likely_turns", &main_directions::likely_turns, nb::arg("reference"), nb::arg("other"), nb::arg("count"),
        nb::arg("separation"), nb::arg("least"));
}
