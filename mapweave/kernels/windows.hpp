// Stretches of a map's polylines, sampled, and proposals that agree. The twins and the words are in
// matching/windows.py and distinct.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <complex>
#include <tuple>
#include <vector>

#include "arrays.hpp"
#include "proposals.hpp"

namespace windows {

using Complex = std::complex<double>;

// Directions (k, m) and places (k, m, 2) of samples, each in the middle of its share of a window.
inline std::tuple<Out<Complex>, Out<double>> sample_windows(In<double, 2> segments, In<double, 1> begin, double length,
                                                           int64_t samples) {
  const size_t n = segments.shape(0), k = begin.shape(0), m = static_cast<size_t>(std::max<int64_t>(samples, 0));
  if (segments.shape(1) != 4 || (n == 0 && k > 0) || samples < 1)
    throw std::invalid_argument("segments (n, 4), one or more of them and of the samples expected");
  std::vector<double> ends(n), lengths(n), unit(2 * n);
  double total = 0;
  for (size_t i = 0; i < n; ++i) {
    const double* s = segments.data() + 4 * i;
    const double dx = s[2] - s[0], dy = s[3] - s[1], by = std::hypot(dx, dy);
    lengths[i] = by, ends[i] = total += by;
    unit[2 * i] = dx / (by > 0 ? by : 1), unit[2 * i + 1] = dy / (by > 0 ? by : 1);
  }
  std::vector<Complex> codes(k * m);
  std::vector<double> points(2 * k * m);
  for (size_t w = 0; w < k; ++w) {
    size_t i = 0;
    for (size_t j = 0; j < m; ++j) {
      const double share = length * (static_cast<double>(j) + 0.5) / static_cast<double>(samples);
      const double at = begin.data()[w] + share;
      if (j == 0) i = static_cast<size_t>(std::upper_bound(ends.begin(), ends.end(), at) - ends.begin());
      while (i < n && ends[i] <= at) ++i;
      const size_t on = std::min(i, n - 1);
      const double along = at - (ends[on] - lengths[on]), u = unit[2 * on], v = unit[2 * on + 1];
      codes[w * m + j] = Complex(u, v);
      points[2 * (w * m + j)] = segments.data()[4 * on] + along * u;
      points[2 * (w * m + j) + 1] = segments.data()[4 * on + 1] + along * v;
    }
  }
  return {give(std::move(codes), {k, m}), give(std::move(points), {k, m, 2})};
}

// Groups of proposals that agree with the first that is in no group yet: which that is, where each begins, who
// is in it.
inline std::tuple<Out<int64_t>, Out<int64_t>, Out<int64_t>> agreeing(In<double, 2> place, In<double, 1> turn,
                                                                     int64_t count, double distance, double angle) {
  const size_t n = turn.shape(0);
  if (place.shape(0) != n || place.shape(1) != 2) throw std::invalid_argument("place (n, 2), turn (n,) expected");
  std::vector<bool> left(n, true);
  std::vector<int64_t> bests, start{0}, members;
  for (size_t best = 0; best < n && static_cast<int64_t>(bests.size()) < count; ++best) {
    if (!left[best]) continue;
    for (size_t k = 0; k < n; ++k) {
      const double dx = place(k, 0) - place(best, 0), dy = place(k, 1) - place(best, 1);
      if (std::abs(dx) > distance || std::abs(dy) > distance) continue;  // most of them
      if (!(std::hypot(dx, dy) <= distance && std::abs(proposals::wrap(turn(k) - turn(best))) <= angle)) continue;
      members.push_back(static_cast<int64_t>(k));
      left[k] = false;
    }
    left[best] = false;
    bests.push_back(static_cast<int64_t>(best));
    start.push_back(static_cast<int64_t>(members.size()));
  }
  const size_t groups = bests.size(), all = members.size();
  return {give(std::move(bests), {groups}), give(std::move(start), {groups + 1}), give(std::move(members), {all})};
}

}  // namespace windows

inline void bind_windows(nb::module_& m) {
  m.def("sample_windows", &windows::sample_windows, nb::arg("segments"), nb::arg("begin"), nb::arg("length"),
        nb::arg("samples"));
  m.def("agreeing", &windows::agreeing, nb::arg("place"), nb::arg("turn"), nb::arg("count"), nb::arg("distance"),
        nb::arg("angle"));
}
