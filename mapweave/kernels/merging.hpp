// Discrete Segment Evolution, scan by scan (paper, VI). The twin and the words are in merging.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <iterator>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "segment_tree.hpp"

namespace merging {

constexpr int64_t kNoScan = -1;

class EvolvingMap {
 public:
  EvolvingMap(nb::handle rules, In<double, 2> segments, In<double, 1> weights)
      : rules_(Rules::of(rules)), tree_(segments_) {
    const size_t n = check(segments);
    if (weights.shape(0) != n) throw std::invalid_argument("weights: one a segment expected");
    for (size_t i = 0; i < n; ++i) {
      if (!(std::isfinite(weights.data()[i]) && weights.data()[i] >= 0))
        throw std::invalid_argument("weights: numbers of 0 or more expected");
      left_.push_back(enter(read(segments, i, weights.data()[i])));
      sightings_.push_back(left_.back());
    }
    const nb::gil_scoped_release others_go_on;
    tree_.rebuild(left_);
  }
  EvolvingMap(const EvolvingMap& other)
      : rules_(other.rules_), segments_(other.segments_), parent_(other.parent_), scans_(other.scans_),
        left_(other.left_), sightings_(other.sightings_), tree_(other.tree_, segments_), queue_(other.queue_) {}
  EvolvingMap& operator=(const EvolvingMap&) = delete;

  // G_t from G_(t-1) and the aligned S_t: pair creation, then simplification (VI).
  void merge_scan(In<double, 2> segments, int64_t scan) {
    const size_t k = check(segments);
    if (scan < 0) throw std::invalid_argument("scan: 0 or more expected");
    std::vector<int64_t> fresh;
    for (size_t i = 0; i < k; ++i) {
      fresh.push_back(enter(read(segments, i, -1.0)));
      scans_[fresh.back()].push_back(scan);
    }
    sightings_.insert(sightings_.end(), fresh.begin(), fresh.end());
    std::vector<int64_t> everything = left_;
    everything.insert(everything.end(), fresh.begin(), fresh.end());
    const Pairing pairing = pairing_of(everything);
    const int64_t settled = static_cast<int64_t>(segments_.size()) - static_cast<int64_t>(k);
    create_pairs(fresh, pairing);
    for (int64_t number = settled; number < static_cast<int64_t>(segments_.size()); ++number)
      if (parent_[number] == number) tree_.add(number);
    for (int64_t number = settled; number < static_cast<int64_t>(segments_.size()); ++number)
      if (parent_[number] == number) look_for_partner(number, pairing);
    run(pairing);
    keep_left(settled);
  }

  // Merges the cheapest pair again and again until none is cheap enough (VI); the first `settled`
  // are merged among themselves.
  void simplify(int64_t settled) {
    const nb::gil_scoped_release others_go_on;
    const Pairing pairing = pairing_of(left_);
    for (const int64_t number : left_)
      if (number >= settled) look_for_partner(number, pairing);
    run(pairing);
    left_ = tree_.members();
  }

  Out<double> segments() const {
    std::vector<double> values;
    values.reserve(4 * left_.size());
    for (const int64_t number : left_) {
      const Segment& s = segments_[number];
      values.insert(values.end(), {s.start.x, s.start.y, s.end.x, s.end.y});
    }
    return give(std::move(values), {left_.size(), 4});
  }

  Out<double> weights() const {
    std::vector<double> values;
    for (const int64_t number : left_) values.push_back(segments_[number].weight);
    return give(std::move(values), {left_.size()});
  }

  Out<int64_t> numbers() const {
    std::vector<int64_t> values = left_;
    return give(std::move(values), {left_.size()});
  }

  // Where each input went: those at the start, then scan by scan.
  Out<int64_t> labels() {
    std::vector<int64_t> end(parent_.size());
    for (size_t i = parent_.size(); i-- > 0;)  // what is merged is younger than what it is of
      end[i] = parent_[i] == static_cast<int64_t>(i) ? place_of(parent_[i]) : end[parent_[i]];
    std::vector<int64_t> labels;
    labels.reserve(sightings_.size());
    for (const int64_t number : sightings_) labels.push_back(end[number]);
    return give(std::move(labels), {sightings_.size()});
  }

  // How many scans saw each segment and which saw it last, when `owner` takes over the others.
  std::pair<Out<int64_t>, Out<int64_t>> seen(In<int64_t, 1> owner) const {
    const size_t n = left_.size();
    if (owner.shape(0) != n) throw std::invalid_argument("owner: one a segment expected");
    std::vector<std::vector<int64_t>> taken(n);
    std::vector<int64_t> support(n, 0), last(n, kNoScan);
    for (size_t i = 0; i < n; ++i) {
      const int64_t to = owner.data()[i];
      if (to < 0 || to >= static_cast<int64_t>(n)) throw std::invalid_argument("owner: indices of segments expected");
      if (to != static_cast<int64_t>(i)) taken[to].push_back(left_[i]);
    }
    for (size_t i = 0; i < n; ++i) {
      if (owner.data()[i] != static_cast<int64_t>(i)) continue;
      const std::vector<int64_t>& own = scans_[left_[i]];
      std::vector<int64_t> all;
      for (const int64_t number : taken[i]) all = united(all.empty() ? own : all, scans_[number]);
      const std::vector<int64_t>& scans = taken[i].empty() ? own : all;
      support[i] = static_cast<int64_t>(scans.size());
      if (!scans.empty()) last[i] = scans.back();
    }
    return {give(std::move(support), {n}), give(std::move(last), {n})};
  }

 private:
  using Entry = std::tuple<double, int64_t, int64_t>;  // cost, younger, older

  Rules rules_;
  std::vector<Segment> segments_;            // by number, in the order of their making
  std::vector<int64_t> parent_;              // into what each was merged, itself if it is left
  std::vector<std::vector<int64_t>> scans_;  // that saw each, ascending, while it is left
  std::vector<int64_t> left_;                // ascending
  std::vector<int64_t> sightings_;           // numbers of the inputs
  SegmentTree tree_;                         // of those left
  std::priority_queue<Entry, std::vector<Entry>, std::greater<Entry>> queue_;

  static size_t check(In<double, 2> segments) {
    if (segments.shape(1) != 4) throw std::invalid_argument("segments: (n, 4) expected");
    const size_t n = segments.shape(0);
    for (size_t i = 0; i < 4 * n; ++i)
      if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
    return n;
  }

  // A negative weight stands for the length: seen once.
  static Segment read(In<double, 2> segments, size_t i, double weight) {
    const double* s = segments.data() + 4 * i;
    Segment segment = Segment::of({s[0], s[1]}, {s[2], s[3]}, weight);
    if (weight < 0) segment.weight = segment.length;
    return segment;
  }

  static std::vector<int64_t> united(const std::vector<int64_t>& a, const std::vector<int64_t>& b) {
    std::vector<int64_t> both;
    both.reserve(a.size() + b.size());
    std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(both));
    return both;
  }

  int64_t enter(const Segment& segment) {
    segments_.push_back(segment);
    parent_.push_back(static_cast<int64_t>(parent_.size()));
    scans_.emplace_back();
    return parent_.back();
  }

  int64_t place_of(int64_t number) const {
    return std::lower_bound(left_.begin(), left_.end(), number) - left_.begin();
  }

  Pairing pairing_of(const std::vector<int64_t>& numbers) const {
    std::vector<double> angles, mass;
    for (const int64_t number : numbers) angles.push_back(segments_[number].angle), mass.push_back(segments_[number].weight);
    return Pairing(rules_, main_directions::find(angles, mass, rules_.directions));
  }

  // Replaces pairs of a known segment and one of `fresh`, cheapest first, each in one at most.
  void create_pairs(const std::vector<int64_t>& fresh, const Pairing& pairing) {
    std::vector<Entry> pairs;
    for (const int64_t number : fresh)
      for (const Partner& partner : tree_.all(segments_[number], pairing))
        pairs.emplace_back(partner.cost, partner.number, number);
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [cost, old, number] : pairs)
      if (parent_[old] == old && parent_[number] == number) {
        tree_.remove(old);
        merge(old, number, pairing);
      }
  }

  int64_t merge(int64_t first, int64_t second, const Pairing& pairing) {
    const int64_t number = enter(pairing.merged(segments_[first], segments_[second]));
    std::vector<int64_t>& longer = scans_[first].size() < scans_[second].size() ? scans_[second] : scans_[first];
    std::vector<int64_t>& shorter = scans_[first].size() < scans_[second].size() ? scans_[first] : scans_[second];
    if (shorter.size() == 1 && (longer.empty() || longer.back() <= shorter[0])) {
      if (longer.empty() || longer.back() < shorter[0]) longer.push_back(shorter[0]);
      scans_[number] = std::move(longer);
    } else {
      scans_[number] = united(longer, shorter);
    }
    scans_[first] = {}, scans_[second] = {};
    parent_[first] = parent_[second] = number;
    return number;
  }

  void look_for_partner(int64_t number, const Pairing& pairing) {
    const Partner partner = tree_.cheapest(number, pairing);
    if (partner.cost < kNever) queue_.emplace(partner.cost, number, partner.number);
  }

  // Merges the cheapest pair until the queue is empty.
  void run(const Pairing& pairing) {
    while (!queue_.empty()) {
      const auto [cost, younger, older] = queue_.top();
      queue_.pop();
      if (parent_[younger] != younger) continue;
      if (parent_[older] != older) {
        look_for_partner(younger, pairing);
        continue;
      }
      tree_.remove(younger);
      tree_.remove(older);
      const int64_t number = merge(younger, older, pairing);
      tree_.add(number);
      look_for_partner(number, pairing);
    }
  }

  // Drops those merged from `left_`, and adds those from number `first` on that are left.
  void keep_left(int64_t first) {
    left_.erase(std::remove_if(left_.begin(), left_.end(), [&](int64_t number) { return parent_[number] != number; }),
                left_.end());
    for (int64_t number = first; number < static_cast<int64_t>(segments_.size()); ++number)
      if (parent_[number] == number) left_.push_back(number);
  }
};

}  // namespace merging

inline void bind_merging(nb::module_& m) {
  using merging::EvolvingMap;
  nb::class_<EvolvingMap>(m, "EvolvingMap")
      .def(nb::init<nb::handle, In<double, 2>, In<double, 1>>(), nb::arg("rules"), nb::arg("segments"), nb::arg("weights"))
      .def("merge_scan", &EvolvingMap::merge_scan, nb::arg("segments"), nb::arg("scan"))
      .def("simplify", &EvolvingMap::simplify, nb::arg("settled") = 0)
      .def("segments", &EvolvingMap::segments)
      .def("weights", &EvolvingMap::weights)
      .def("numbers", &EvolvingMap::numbers)
      .def("labels", &EvolvingMap::labels)
      .def("seen", &EvolvingMap::seen, nb::arg("owner"))
      .def("__deepcopy__", [](const EvolvingMap& self, nb::handle) { return self; }, nb::arg("memo"));
}
