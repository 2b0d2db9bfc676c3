// How many scans saw through each segment. The twin and the words are in denials.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "arrays.hpp"

namespace denials {

constexpr double kTurn = 6.283185307179586476925286766559;

struct Rules {
  double spacing, clearance, least_sine, share;
};

struct Witness {
  int64_t scan;
  std::vector<double> clear;  // [m] that each beam saw through
  double first, step;         // [rad] of the first beam, from beam to beam
  double x, y, cosine, sine;  // of the sensor
  double farthest;            // [m] of all beams

  // Whether it sees through a point, its beams not running along the segment there.
  bool sees_through(double px, double py, double along_x, double along_y, const Rules& rules) const {
    const double dx = px - x, dy = py - y;
    const double range = std::sqrt(dx * dx + dy * dy);
    if (!(range < farthest - rules.clearance)) return false;
    if (!(std::abs(dx * along_y - dy * along_x) >= rules.least_sine * range)) return false;
    const int64_t count = static_cast<int64_t>(clear.size());
    double steps = std::fmod(std::atan2(cosine * dy - sine * dx, cosine * dx + sine * dy) - first, kTurn);
    if (steps < 0) steps += kTurn;
    steps /= step;
    const bool closed = static_cast<double>(count) * step > kTurn - step / 2;
    if (!(steps <= static_cast<double>(count - 1) || closed)) return false;
    int64_t beam = static_cast<int64_t>(std::nearbyint(steps));
    if (beam >= count) beam = 0;
    return range < clear[beam] - rules.clearance;
  }

  // Whether it sees through enough of a segment x1 y1 x2 y2.
  bool denies(const double* s, const Rules& rules) const {
    const double run_x = s[2] - s[0], run_y = s[3] - s[1];
    const double length = std::sqrt(run_x * run_x + run_y * run_y);
    const double off_x = (s[0] + s[2]) / 2 - x, off_y = (s[1] + s[3]) / 2 - y;
    if (std::sqrt(off_x * off_x + off_y * off_y) - length / 2 > farthest) return false;
    const int64_t count = static_cast<int64_t>(std::ceil(length / rules.spacing)) + 1;
    const double scale = std::max(length, 1e-12);
    const double enough = rules.share * static_cast<double>(count);
    int64_t seen = 0;
    for (int64_t k = 0; k < count; ++k) {
      const double at = (static_cast<double>(k) + 0.5) / static_cast<double>(count);
      seen += sees_through(s[0] + at * run_x, s[1] + at * run_y, run_x / scale, run_y / scale, rules);
      if (static_cast<double>(seen + count - k - 1) < enough) return false;
    }
    return seen > 0 && static_cast<double>(seen) >= enough;
  }
};

class Witnesses {
 public:
  Witnesses(double spacing, double clearance, double incidence, double share)
      : rules_{spacing, clearance, std::sin(incidence), share} {
    if (!(spacing > 0)) throw std::invalid_argument("spacing: > 0 expected");
  }

  int64_t size() const { return static_cast<int64_t>(witnesses_.size()); }

  void add(int64_t scan, In<double, 1> clear, double first, double step, In<double, 1> pose) {
    if (clear.shape(0) < 1 || pose.shape(0) != 3) throw std::invalid_argument("clear: a beam or more, pose: (3,) expected");
    const double turn = pose.data()[2];
    Witness witness{scan, {}, first, step, pose.data()[0], pose.data()[1], std::cos(turn), std::sin(turn), 0.0};
    witness.clear.assign(clear.data(), clear.data() + clear.shape(0));
    witness.farthest = *std::max_element(witness.clear.begin(), witness.clear.end());
    witnesses_.push_back(std::move(witness));
  }

  // How many witnesses later than `last_seen` saw through each segment.
  Out<int64_t> count(In<double, 2> segments, In<int64_t, 1> last_seen) const {
    const size_t n = check(segments, last_seen);
    std::vector<int64_t> counts(n, 0);
    for (size_t i = 0; i < n; ++i)
      for (const Witness& witness : witnesses_)
        counts[i] += witness.scan > last_seen.data()[i] && witness.denies(segments.data() + 4 * i, rules_);
    return give(std::move(counts), {n});
  }

  // The same of segments with ascending numbers; what is known from the call before is not asked.
  Out<int64_t> count_numbered(In<int64_t, 1> numbers, In<double, 2> segments, In<int64_t, 1> last_seen) {
    const size_t n = check(segments, last_seen);
    if (numbers.shape(0) != n) throw std::invalid_argument("numbers: one a segment expected");
    std::vector<int64_t> counts(n, 0);
    std::vector<Known> known;
    known.reserve(n);
    size_t at = 0;
    for (size_t i = 0; i < n; ++i) {
      const int64_t number = numbers.data()[i];
      if (i > 0 && number <= numbers.data()[i - 1]) throw std::invalid_argument("numbers: ascending ones expected");
      while (at < known_.size() && known_[at].number < number) ++at;
      known.push_back(at < known_.size() && known_[at].number == number ? std::move(known_[at]) : Known{number, {}});
      std::vector<int8_t>& verdicts = known.back().verdicts;
      for (size_t k = witnesses_.size(); k-- > 0;) {
        const Witness& witness = witnesses_[k];
        if (witness.scan <= last_seen.data()[i]) continue;
        if (verdicts.size() <= k) verdicts.resize(witnesses_.size(), kUnknown);
        if (verdicts[k] == kUnknown) verdicts[k] = witness.denies(segments.data() + 4 * i, rules_);
        counts[i] += verdicts[k];
      }
    }
    known_ = std::move(known);
    return give(std::move(counts), {n});
  }

 private:
  static constexpr int8_t kUnknown = -1;
  struct Known {
    int64_t number;
    std::vector<int8_t> verdicts;  // of each witness
  };

  Rules rules_;
  std::vector<Witness> witnesses_;
  std::vector<Known> known_;  // by ascending number

  static size_t check(In<double, 2> segments, In<int64_t, 1> last_seen) {
    if (segments.shape(1) != 4) throw std::invalid_argument("segments: (n, 4) expected");
    if (last_seen.shape(0) != segments.shape(0)) throw std::invalid_argument("last_seen: one a segment expected");
    for (size_t i = 0; i < 4 * segments.shape(0); ++i)
      if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
    return segments.shape(0);
  }
};

}  // namespace denials

inline void bind_denials(nb::module_& m) {
  using denials::Witnesses;
  nb::class_<Witnesses>(m, "Witnesses")
      .def(nb::init<double, double, double, double>(), nb::arg("spacing"), nb::arg("clearance"), nb::arg("incidence"),
           nb::arg("share"))
      .def("__len__", &Witnesses::size)
      .def("add", &Witnesses::add, nb::arg("scan"), nb::arg("clear"), nb::arg("first"), nb::arg("step"), nb::arg("pose"))
      .def("count", &Witnesses::count, nb::arg("segments"), nb::arg("last_seen"))
      .def("count_numbered", &Witnesses::count_numbered, nb::arg("numbers"), nb::arg("segments"), nb::arg("last_seen"))
      .def("__deepcopy__", [](const Witnesses& self, nb::handle) { return self; }, nb::arg("memo"));
}
