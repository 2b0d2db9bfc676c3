// What merging with any of a node's segments costs at least (paper, VII, as intervals).
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "merging_rules.hpp"

namespace merging {

constexpr double kRounding = 1e-9;     // [m] or [rad] that two ways to compute one may differ by
constexpr double kCostRounding = 2e-12;  // [m]; costs closer than this are equal
constexpr double kWide = 1.2;          // [rad] beyond which turns tell nothing
constexpr double kSteep = 0.5;         // [rad] up to which `tangent` bounds

struct Range {
  double low = kNever, high = -kNever;

  void add(double value) { low = std::min(low, value), high = std::max(high, value); }
  double extent() const { return high - low; }
  double nearest_zero() const { return std::max(0.0, std::max(low, -high)); }
  double farthest_zero() const { return std::max(std::abs(low), std::abs(high)); }
};
inline Range operator+(Range a, Range b) { return {a.low + b.low, a.high + b.high}; }
inline Range operator-(Range a, double k) { return {a.low - k, a.high - k}; }
inline Range operator-(Range a) { return {-a.high, -a.low}; }
inline Range operator*(double k, Range a) { return k < 0 ? Range{k * a.high, k * a.low} : Range{k * a.low, k * a.high}; }
inline Range operator*(Range a, Range b) {
  const double p = a.low * b.low, q = a.low * b.high, r = a.high * b.low, s = a.high * b.high;
  return {std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s))};
}

// What the tangents of angles up to `kSteep` lie between.
inline Range tangent(Range angle) {
  const auto more = [](double t) { return t + 0.4 * t * t * t; };
  return {angle.low < 0 ? more(angle.low) : angle.low, angle.high > 0 ? more(angle.high) : angle.high};
}

inline double least_sine(double angle) { return angle - angle * angle * angle / 6; }
inline double wrapped(double turn) {
  constexpr double half = main_directions::kPeriod;
  while (turn > half) turn -= 2 * half;
  while (turn < -half) turn += 2 * half;
  return turn;
}

struct Node {
  Vector origin{0, 0}, unit{1, 0};
  double angle = 0;
  Range start_along, start_height, end_along, end_height, middle_along, middle_height;
  Range rise, run, turn, length, weight;  // of ends: from start to end, across and along the frame
  int64_t first = std::numeric_limits<int64_t>::max();  // the lowest number in here
  int64_t count = 0;
  int32_t parent = -1, left = -1, right = -1;
  int axis = 0;
  double threshold = 0;
  std::vector<int64_t> members;

  void lay(Vector at, Vector direction) {
    origin = at, unit = direction, angle = std::atan2(unit.y, unit.x);
    start_along = start_height = end_along = end_height = middle_along = middle_height = Range{};
    rise = run = turn = length = weight = Range{};
  }

  void take_frame(const Node& other) {
    origin = other.origin, unit = other.unit, angle = other.angle;
    start_along = other.start_along, start_height = other.start_height;
    end_along = other.end_along, end_height = other.end_height;
    middle_along = other.middle_along, middle_height = other.middle_height;
    rise = other.rise, run = other.run, turn = other.turn, length = other.length, weight = other.weight;
  }

  double across() const { return start_height.extent() + end_height.extent(); }
  bool is_leaf() const { return left < 0; }
  Vector local(Vector point) const { return {dot(unit, point - origin), cross(unit, point - origin)}; }

  void add(const Segment& segment) {
    const Vector start = local(segment.start), end = local(segment.end), middle = local(segment.middle);
    start_along.add(start.x), start_height.add(start.y);
    end_along.add(end.x), end_height.add(end.y);
    middle_along.add(middle.x), middle_height.add(middle.y);
    rise.add(end.y - start.y), run.add(end.x - start.x);
    turn.add(wrapped(segment.angle - angle));
    length.add(segment.length), weight.add(segment.weight);
  }

  // What a segment is sorted by.
  double value(int axis, const Segment& segment, int64_t number) const {
    if (axis == 0) return local(segment.start).y;
    if (axis == 1) return local(segment.end).y;
    if (axis == 2) return local(segment.middle).x;
    if (axis == 3) return segment.length;
    return axis == 4 ? wrapped(segment.angle - angle) : static_cast<double>(number);
  }
};

// Bounds what merging `segment` with any of a node's costs.
class Bound {
 public:
  Bound(const Segment& segment, const Pairing& pairing) : segment_(segment), pairing_(pairing) {
    for (const double main : pairing.mains) mains_.push_back(main_directions::line_difference(main, segment.angle));
  }

  // At least that, or more than `most`.
  double of(const Node& node, double most) const {
    const Rules& rules = pairing_.rules;
    const Vector middle = node.local(segment_.middle);
    const double cosine = dot(node.unit, segment_.unit), sine = cross(node.unit, segment_.unit);
    const double half = segment_.length / 2;
    const Range along = merged(node.start_along, node.end_along), height = merged(node.start_height, node.end_height);
    const double apart_along = (along - middle.x).nearest_zero() - half * std::abs(cosine);
    const double apart_across = (height - middle.y).nearest_zero() - half * std::abs(sine);
    double gap = size({std::max(apart_along, 0.0), std::max(apart_across, 0.0)});
    if (gap > rules.max_gap + kRounding || (node.count == 0)) return kNever;
    const double own = wrapped(segment_.angle - node.angle);
    const double low = wrapped(node.turn.low - own);
    const Range turn{low, low + node.turn.extent()};  // from `segment`
    if (turn.extent() > kWide || turn.farthest_zero() > 2 * kWide) return rules.proximity * gap - kCostRounding;
    if (turn.nearest_zero() > rules.max_angle + kRounding) return kNever;
    if (turn.farthest_zero() > kWide) return rules.proximity * gap - kCostRounding;
    const double step = least_step(node, turn, own, middle);
    const double shorter = std::min(segment_.length, node.length.high);
    if (step > rules.max_step + rules.turn_noise * shorter + kRounding) return kNever;
    gap = std::max(gap, least_gap(node, cosine, sine, middle, along));
    if (gap > rules.max_gap + kRounding) return kNever;
    const double so_far = rules.collinearity * step + rules.proximity * gap - kCostRounding;
    return so_far > most ? so_far : so_far + rules.parallelism * least_opening(node, turn, own);
  }

 private:
  const Segment& segment_;
  const Pairing& pairing_;
  std::vector<double> mains_;  // main directions from that of `segment` [rad]

  static Range merged(Range a, Range b) { return {std::min(a.low, b.low), std::max(a.high, b.high)}; }

  // Of the segment and of a candidate, at least; 0 where nothing weighs anything.
  double own_share(const Node& node) const { return share(segment_.weight, node.weight.high); }
  double other_share(const Node& node) const { return share(node.weight.low, segment_.weight); }
  static double share(double weight, double other) { return weight + other > 0 ? weight / (weight + other) : 0.0; }

  // The weighted mean directions, from that of the segment: its share of the turn, or less.
  Range means(const Node& node, Range turn) const {
    const double most = 1 - own_share(node);
    const double part = most <= 0.5 ? most : 1.0;
    return {part * std::min(turn.low, 0.0), part * std::max(turn.high, 0.0)};
  }

  // Of parC: `segment` rises by its share, and so does the other.
  double least_opening(const Node& node, Range turn, double own) const {
    const Rules& rules = pairing_.rules;
    const double own_part = own_share(node), other_part = other_share(node);
    const Range mean = means(node, turn);
    double followed = kNever;
    bool always = false;
    for (const double main : mains_) {
      const Range from{main - mean.high, main - mean.low};
      const double far = from.farthest_zero();
      const double near = std::min(from.nearest_zero(), std::max(main_directions::kPeriod - far, 0.0));
      const double low = std::max(segment_.length, node.length.low) / 2;
      const double high = std::max(segment_.length, node.length.high) / 2;
      if (near > rules.direction_tolerance + kRounding || low * least_sine(near) > rules.max_shift + kRounding) continue;
      const double slope = own + main;  // of the main direction in the frame
      double rise = 0.0;
      if (std::abs(slope) <= kSteep) rise = (node.rise + -(node.run * tangent({slope, slope}))).nearest_zero() * (1 - slope * slope / 2);
      followed = std::min(followed, own_part * segment_.length * std::abs(main) + other_part * rise);
      always |= far <= rules.direction_tolerance - kRounding && high * far <= rules.max_shift - kRounding;
    }
    if (always) return followed;
    return std::min(followed, std::min(own_part * segment_.length, other_part * node.length.low) * turn.nearest_zero());
  }

  // Of colC: how far the ends are across the mean direction from the middle of `segment`, or the
  // middles and what the turn adds.
  double least_step(const Node& node, Range turn, double own, Vector middle) const {
    const Range mean = means(node, turn) - -own;
    double ends = 0.0, middles = 0.0;
    if (mean.farthest_zero() <= kSteep) {
      const Range slopes = tangent(mean);
      const double flat = 1 - mean.farthest_zero() * mean.farthest_zero() / 2;
      const auto apart = [&](Range height, Range along) {
        return ((height - middle.y) + -((along - middle.x) * slopes)).nearest_zero() * flat;
      };
      ends = std::max(apart(node.start_height, node.start_along), apart(node.end_height, node.end_along));
      middles = apart(node.middle_height, node.middle_along);
    }
    return std::max(ends, middles + std::min(segment_.length, node.length.low) / 2 * least_sine(turn.nearest_zero()));
  }

  // Of proxC: an end is no nearer to a segment than to its line.
  double least_gap(const Node& node, double cosine, double sine, Vector middle, Range along) const {
    const Range start = cosine * (node.start_height - middle.y) + -(sine * (node.start_along - middle.x));
    const Range end = cosine * (node.end_height - middle.y) + -(sine * (node.end_along - middle.x));
    double least = std::min(start.nearest_zero(), end.nearest_zero());
    const double steepest = node.turn.farthest_zero();
    const Range slopes = steepest <= kSteep ? tangent(node.turn) : Range{-kNever, kNever};
    for (const double way : {-0.5, 0.5}) {
      const double x = middle.x + way * segment_.length * cosine, y = middle.y + way * segment_.length * sine;
      const Range below = node.middle_height - y;
      if (steepest > kSteep) return 0.0;
      const double slack = below.farthest_zero() * slopes.farthest_zero() + kRounding;
      if (x < along.low - slack || x > along.high + slack) continue;  // nearest to an end
      const Range away = below + -((node.middle_along - x) * slopes);
      least = std::min(least, away.nearest_zero() * (1 - steepest * steepest / 2));
    }
    return least;
  }
};

}  // namespace merging
