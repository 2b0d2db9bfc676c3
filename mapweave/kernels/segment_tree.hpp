// Which segment is cheapest to merge with: a tree whose nodes bound what merging costs at least.
//
// Where everybody sees one wall all segments are close to each other: what tells them apart is how
// far their ends are across it. So each node has a frame along its segments, and keeps the ranges of
// what the cost depends on; a search leaves out what cannot be cheaper. Where hundreds lie on each
// other within the noise, many are about as cheap: there a search ends after `kPatience` nodes.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "merging_bound.hpp"

namespace merging {

constexpr size_t kLeaf = 8;              // segments that a leaf holds
constexpr int kPatience = 96;            // nodes that a search looks at: some 100 segments in a heap

struct Partner {
  double cost;
  int64_t number;
};

class SegmentTree {
 public:
  explicit SegmentTree(const std::vector<Segment>& segments) : segments_(segments) { rebuild({}); }
  // The same tree over a copy of its segments.
  SegmentTree(const SegmentTree& other, const std::vector<Segment>& segments)
      : segments_(segments), nodes_(other.nodes_), leaf_(other.leaf_), built_(other.built_), added_(other.added_) {}

  int64_t size() const { return nodes_[0].count; }

  // Starts again with `numbers`, all at once.
  void rebuild(std::vector<int64_t> numbers) {
    nodes_.assign(1, Node{});
    built_ = numbers.size(), added_ = 0;
    nodes_[0].members = std::move(numbers);
    renew(0);
    split(0);
  }

  void add(int64_t number) {
    if (++added_ > built_ / 2 + 32) {
      std::vector<int64_t> all = members();
      all.push_back(number);
      return rebuild(std::move(all));
    }
    const Segment& segment = segments_[number];
    int32_t at = 0;
    while (true) {
      Node& node = nodes_[at];
      node.add(segment);
      node.first = std::min(node.first, number);
      ++node.count;
      if (node.is_leaf()) break;
      at = node.value(node.axis, segment, number) <= node.threshold ? node.left : node.right;
    }
    nodes_[at].members.push_back(number);
    place(number, at);
    split(at);
  }

  void remove(int64_t number) {
    int32_t at = leaf_[number];
    std::vector<int64_t>& members = nodes_[at].members;
    members.erase(std::find(members.begin(), members.end(), number));
    for (; at >= 0; at = nodes_[at].parent) {
      --nodes_[at].count;
      nodes_[at].first = lowest(nodes_[at]);
    }
  }

  // The cheapest partner older than `number`; of two as cheap, the oldest.
  Partner cheapest(int64_t number, const Pairing& pairing) const {
    Partner best{kNever, number};
    const Bound bound(segments_[number], pairing);
    int patience = kPatience;
    search(0, 0.0, number, bound, pairing, best, patience);
    return best;
  }

  // All that `segment` can merge with, ascending.
  std::vector<Partner> all(const Segment& segment, const Pairing& pairing) const {
    std::vector<Partner> found;
    const Bound bound(segment, pairing);
    gather(0, segment, bound, pairing, found);
    std::sort(found.begin(), found.end(), [](Partner a, Partner b) { return a.number < b.number; });
    return found;
  }

  std::vector<int64_t> members() const {
    std::vector<int64_t> all;
    for (const Node& node : nodes_) all.insert(all.end(), node.members.begin(), node.members.end());
    std::sort(all.begin(), all.end());
    return all;
  }

 private:
  const std::vector<Segment>& segments_;
  std::vector<Node> nodes_;
  std::vector<int32_t> leaf_;  // in which each number is
  size_t built_ = 0, added_ = 0;

  int64_t lowest(const Node& node) const {
    if (!node.is_leaf()) return std::min(nodes_[node.left].first, nodes_[node.right].first);
    int64_t first = std::numeric_limits<int64_t>::max();
    for (const int64_t number : node.members) first = std::min(first, number);
    return first;
  }

  void place(int64_t number, int32_t leaf) {
    if (leaf_.size() <= static_cast<size_t>(number)) leaf_.resize(static_cast<size_t>(number) + 1, -1);
    leaf_[number] = leaf;
  }

  // Takes the ranges of a leaf's members in the frame of its parent, or in one along them where
  // they spread less across it.
  void renew(int32_t at) {
    Node& node = nodes_[at];
    node.count = static_cast<int64_t>(node.members.size());
    node.first = lowest(node);
    Vector along{0, 0}, middle{0, 0};
    for (const int64_t number : node.members) {
      place(number, at);
      along = along + segments_[number].along;
      middle = middle + segments_[number].middle;
    }
    node.lay(1.0 / std::max(static_cast<double>(node.count), 1.0) * middle, node.unit);
    Node turned;
    if (merging::size(along) > kRounding) turned.lay(node.origin, 1.0 / merging::size(along) * along);
    for (const int64_t number : node.members) node.add(segments_[number]), turned.add(segments_[number]);
    if (turned.across() < node.across()) node.take_frame(turned);
  }

  // Along which axis the members differ most, by what it matters to the cost.
  int widest(const Node& node) const {
    const double typical = (node.length.low + node.length.high) / 2, along = node.middle_along.extent();
    const double across = std::max(node.start_height.extent(), node.end_height.extent());
    const double relative = node.length.extent() / std::max(node.length.high, kRounding);
    const std::array<double, 5> extents{0.5 * node.start_height.extent(), 0.5 * node.end_height.extent(),
                                        0.01 * along + 0.5 * std::max(along - typical, 0.0),
                                        relative * std::min(across, 0.1),
                                        node.turn.extent() > kSteep ? 0.5 * typical * node.turn.extent() : 0.0};
    const int axis = static_cast<int>(std::max_element(extents.begin(), extents.end()) - extents.begin());
    return extents[axis] > kRounding ? axis : 5;
  }

  // Parts a leaf that holds too many at their median, and what comes of it.
  void split(int32_t at) {
    if (nodes_[at].members.size() <= kLeaf) return;
    renew(at);
    const int axis = widest(nodes_[at]);
    std::vector<double> values;
    for (const int64_t number : nodes_[at].members) values.push_back(nodes_[at].value(axis, segments_[number], number));
    const double threshold = parting(values);
    std::array<Node, 2> halves;
    for (size_t k = 0; k < values.size(); ++k) halves[values[k] <= threshold ? 0 : 1].members.push_back(nodes_[at].members[k]);
    nodes_[at].members = {};
    nodes_[at].axis = axis, nodes_[at].threshold = threshold;
    std::array<int32_t, 2> made{};
    for (size_t k = 0; k < 2; ++k) {
      halves[k].parent = at, halves[k].unit = nodes_[at].unit;
      made[k] = static_cast<int32_t>(nodes_.size());
      nodes_.push_back(std::move(halves[k]));
      renew(made[k]);
    }
    nodes_[at].left = made[0], nodes_[at].right = made[1];
    split(made[0]);
    split(made[1]);
  }

  // The value that parts `values`, which differ, about in halves.
  static double parting(std::vector<double> values) {
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) / 2);
    std::nth_element(values.begin(), middle, values.end());
    const double highest = *std::max_element(values.begin(), values.end());
    if (*middle < highest) return *middle;
    double below = -kNever;
    for (const double value : values)
      if (value < highest) below = std::max(below, value);
    return below;
  }

  // Looks where it may be cheapest first; of a crowd, `patience` nodes are enough.
  void search(int32_t at, double bound, int64_t number, const Bound& query, const Pairing& pairing, Partner& best,
              int& patience) const {
    const Node& node = nodes_[at];
    if (node.count == 0 || node.first >= number || bound > std::min(best.cost, pairing.rules.max_cost)) return;
    if (bound >= best.cost - 2 * kCostRounding && node.first > best.number) return;
    if (--patience < 0 && best.cost < kNever) return;
    if (node.is_leaf()) {
      for (const int64_t other : node.members) {
        if (other >= number) continue;
        const double cost = pairing.cost(segments_[number], segments_[other], best.cost);
        if (cost < best.cost || (cost == best.cost && cost < kNever && other < best.number)) best = {cost, other};
      }
      return;
    }
    const double most = std::min(best.cost, pairing.rules.max_cost);
    double left = query.of(nodes_[node.left], most), right = query.of(nodes_[node.right], most);
    const bool swapped = std::make_pair(right, nodes_[node.right].first) < std::make_pair(left, nodes_[node.left].first);
    search(swapped ? node.right : node.left, swapped ? right : left, number, query, pairing, best, patience);
    search(swapped ? node.left : node.right, swapped ? left : right, number, query, pairing, best, patience);
  }

  void gather(int32_t at, const Segment& segment, const Bound& bound, const Pairing& pairing, std::vector<Partner>& found) const {
    const Node& node = nodes_[at];
    if (node.count == 0 || bound.of(node, pairing.rules.max_cost) > pairing.rules.max_cost) return;
    if (!node.is_leaf()) {
      gather(node.left, segment, bound, pairing, found);
      gather(node.right, segment, bound, pairing, found);
      return;
    }
    for (const int64_t number : node.members) {
      const double cost = pairing.cost(segments_[number], segment, pairing.rules.max_cost);
      if (cost < kNever) found.push_back({cost, number});
    }
  }
};

}  // namespace merging
