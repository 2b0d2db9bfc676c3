// Segments to generalized polylines (paper, V). The twin and the words are in polylines.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <tuple>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace polylines {

constexpr int64_t kNone = -1;
constexpr double kTie = 1e-12;  // [m]; of two choices as cheap, the link

struct Link {
  int64_t source, target;
  double gap;
  bool allowed;
};

// The links with target's start within reach of source's end, by source, then target.
inline std::vector<Link> possible_links(const double* s, size_t n, double max_gap) {
  struct Start {
    int64_t column, row, number;
  };
  const double cell = std::max(max_gap, 1e-3);
  const auto key = [&](double value) { return static_cast<int64_t>(std::floor(value / cell)); };
  const auto before = [](const Start& a, const Start& b) {
    return std::tie(a.column, a.row, a.number) < std::tie(b.column, b.row, b.number);
  };
  std::vector<Start> starts;
  for (size_t i = 0; i < n; ++i) starts.push_back({key(s[4 * i]), key(s[4 * i + 1]), static_cast<int64_t>(i)});
  std::sort(starts.begin(), starts.end(), before);
  std::vector<Link> links;
  for (size_t i = 0; i < n; ++i) {
    const double x = s[4 * i + 2], y = s[4 * i + 3];
    const size_t first = links.size();
    for (int64_t column = key(x) - 1; column <= key(x) + 1; ++column) {
      auto at = std::lower_bound(starts.begin(), starts.end(), Start{column, key(y) - 1, 0}, before);
      for (; at != starts.end() && at->column == column && at->row <= key(y) + 1; ++at) {
        const double dx = s[4 * at->number] - x, dy = s[4 * at->number + 1] - y;
        const double gap = std::sqrt(dx * dx + dy * dy);
        if (gap <= max_gap && at->number != static_cast<int64_t>(i))  // no segment follows itself
          links.push_back({static_cast<int64_t>(i), at->number, gap, true});
      }
    }
    std::sort(links.begin() + static_cast<std::ptrdiff_t>(first), links.end(),
              [](const Link& a, const Link& b) { return a.target < b.target; });
  }
  return links;
}

// The cheapest assignment of successors: shortest augmenting paths, one source after the other.
// A segment without a successor costs `max_gap`.
class Assignment {
 public:
  Assignment(size_t n, const std::vector<Link>& links, double max_gap)
      : links_(links), none_(max_gap + kTie), first_(n + 1, 0), successor_(n, kNone), source_(n, kNone),
        price_(n, 0.0), distance_(n, kFar), from_(n, kNone), done_(n, false) {
    for (const Link& link : links) ++first_[link.source + 1];
    for (size_t i = 0; i < n; ++i) first_[i + 1] += first_[i];
    for (size_t i = 0; i < n; ++i) augment(static_cast<int64_t>(i));
  }

  // The link that each segment follows by, or none.
  const std::vector<int64_t>& links() const { return successor_; }

 private:
  static constexpr double kFar = std::numeric_limits<double>::infinity();
  const std::vector<Link>& links_;
  double none_;
  std::vector<int64_t> first_;      // of the links of each source
  std::vector<int64_t> successor_;  // link of each source
  std::vector<int64_t> source_;     // that each target follows
  std::vector<double> price_;       // of each target, 0 or more
  std::vector<double> distance_;    // to each target
  std::vector<int64_t> from_;       // link that each target was reached by
  std::vector<bool> done_;

  // Its cost, were it without a successor: what the other choice is measured by.
  double own(int64_t source) const {
    const int64_t link = successor_[source];
    return link == kNone ? 0.0 : links_[link].gap + price_[links_[link].target];
  }

  // Whether the cheapest link of `root` leads to a free target: then it is taken.
  bool take_free(int64_t root) {
    int64_t best = kNone;
    double least = none_;
    for (int64_t k = first_[root]; k < first_[root + 1]; ++k) {
      const double cost = links_[k].gap + price_[links_[k].target];
      if (links_[k].allowed && cost < least) least = cost, best = k;
    }
    if (best == kNone) return true;  // none is as cheap
    if (source_[links_[best].target] != kNone) return false;
    successor_[root] = best, source_[links_[best].target] = root;
    return true;
  }

  void augment(int64_t root) {
    if (take_free(root)) return;
    using Step = std::tuple<double, int64_t>;  // distance, target
    std::priority_queue<Step, std::vector<Step>, std::greater<Step>> queue;
    std::vector<int64_t> reached, settled;
    double best = kFar;
    int64_t end_source = root, end_target = kNone;
    const auto leave = [&](int64_t source, double so_far) {
      const double without = so_far + none_ - own(source);
      if (without < best) best = without, end_source = source, end_target = kNone;
      for (int64_t k = first_[source]; k < first_[source + 1]; ++k) {
        const Link& link = links_[k];
        if (!link.allowed || k == successor_[source] || done_[link.target]) continue;
        const double distance = so_far + link.gap + price_[link.target] - own(source);
        if (distance >= distance_[link.target]) continue;
        if (distance_[link.target] == kFar) reached.push_back(link.target);
        distance_[link.target] = distance, from_[link.target] = k;
        queue.emplace(distance, link.target);
      }
    };
    leave(root, 0.0);
    while (!queue.empty()) {
      const auto [distance, target] = queue.top();
      queue.pop();
      if (done_[target] || distance > distance_[target]) continue;
      if (distance >= best) break;
      done_[target] = true;
      settled.push_back(target);
      if (source_[target] == kNone) {
        best = distance, end_target = target;
        break;
      }
      leave(source_[target], distance);
    }
    for (const int64_t target : settled) price_[target] += std::max(best - distance_[target], 0.0);
    assign(root, end_source, end_target);
    for (const int64_t target : reached) distance_[target] = kFar, done_[target] = false;
  }

  // Takes the path to a free target, or to a source that gives up its own.
  void assign(int64_t root, int64_t end_source, int64_t end_target) {
    int64_t target = end_target;
    if (end_target == kNone) {
      target = successor_[end_source] == kNone ? kNone : links_[successor_[end_source]].target;
      successor_[end_source] = kNone;
      if (end_source == root) return;
    }
    while (true) {
      const int64_t link = from_[target], source = links_[link].source;
      const int64_t given_up = successor_[source];
      successor_[source] = link, source_[target] = source;
      if (source == root) return;
      target = links_[given_up].target;
    }
  }
};

// Walks along the successors from `segment`, over those unseen.
inline std::vector<int64_t> walk(int64_t segment, const std::vector<int64_t>& chosen, const std::vector<Link>& links,
                                 std::vector<bool>& unseen) {
  std::vector<int64_t> walked;
  while (segment != kNone && unseen[segment]) {
    unseen[segment] = false;
    walked.push_back(segment);
    segment = chosen[segment] == kNone ? kNone : links[chosen[segment]].target;
  }
  return walked;
}

inline std::pair<Out<int64_t>, Out<int64_t>> group(In<double, 2> segments, double max_gap) {
  if (segments.shape(1) != 4) throw std::invalid_argument("segments: (n, 4) expected");
  const size_t n = segments.shape(0);
  for (size_t i = 0; i < 4 * n; ++i)
    if (!std::isfinite(segments.data()[i])) throw std::invalid_argument("segments: finite numbers expected");
  std::vector<Link> links = possible_links(segments.data(), n, max_gap);
  while (true) {
    const std::vector<int64_t> chosen = Assignment(n, links, max_gap).links();
    std::vector<bool> unseen(n, true), followed(n, false);
    for (const int64_t link : chosen)
      if (link != kNone) followed[links[link].target] = true;
    std::vector<int64_t> order, polyline;
    int64_t count = 0;
    for (size_t i = 0; i < n; ++i) {
      if (followed[i]) continue;
      const std::vector<int64_t> chain = walk(static_cast<int64_t>(i), chosen, links, unseen);
      order.insert(order.end(), chain.begin(), chain.end());
      polyline.insert(polyline.end(), chain.size(), count++);
    }
    if (order.size() == n) return {give(std::move(order), {n}), give(std::move(polyline), {n})};
    for (size_t i = 0; i < n; ++i) {  // each circle loses its longest link
      if (!unseen[i]) continue;
      const std::vector<int64_t> circle = walk(static_cast<int64_t>(i), chosen, links, unseen);
      const auto shorter = [&](int64_t a, int64_t b) { return links[chosen[a]].gap < links[chosen[b]].gap; };
      links[chosen[*std::max_element(circle.begin(), circle.end(), shorter)]].allowed = false;
    }
  }
}

}  // namespace polylines

inline void bind_polylines(nb::module_& m) {
  m.def("group_polylines", &polylines::group, nb::arg("segments"), nb::arg("max_gap"));
}
