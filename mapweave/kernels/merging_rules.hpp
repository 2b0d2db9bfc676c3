// Which segments merge, at what cost and into what (paper, VI and VII).
// The twin and the words are in merging_rules.py and merging_cost.py.
#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "arrays.hpp"
#include "main_directions.hpp"

namespace merging {

constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kOrthogonal = 1e-9;  // cosines below count as zero

struct Vector {
  double x, y;
};
inline Vector operator+(Vector a, Vector b) { return {a.x + b.x, a.y + b.y}; }
inline Vector operator-(Vector a, Vector b) { return {a.x - b.x, a.y - b.y}; }
inline Vector operator*(double k, Vector a) { return {k * a.x, k * a.y}; }
inline double dot(Vector a, Vector b) { return a.x * b.x + a.y * b.y; }
inline double cross(Vector a, Vector b) { return a.x * b.y - a.y * b.x; }
inline double size(Vector a) { return std::sqrt(a.x * a.x + a.y * a.y); }

struct Segment {
  Vector start, end;
  double weight, length, angle;
  Vector along, unit, middle;  // `unit` is zero where the length is

  static Segment of(Vector start, Vector end, double weight) {
    const Vector along = end - start;
    const double length = size(along);
    const Vector unit = 1.0 / (length > 0 ? length : 1.0) * along;
    const double angle = std::atan2(along.y, along.x);
    return {start, end, weight, length, angle, along, unit, 0.5 * (start + end)};
  }
};

struct Rules {
  double max_cost, max_step, max_gap, max_angle, turn_noise, end_noise, direction_tolerance, max_shift;
  double parallelism, collinearity, proximity;
  main_directions::Rules directions;

  static Rules of(nb::handle given) {
    const auto number = [&](const char* name) { return nb::cast<double>(given.attr(name)); };
    return {number("max_cost"),   number("max_step"),     number("max_gap"),
            number("max_angle"),  number("turn_noise"),   number("end_noise"),
            number("direction_tolerance"), number("max_shift"), number("parallelism"),
            number("collinearity"), number("proximity"),  main_directions::Rules::of(given.attr("directions"))};
  }
};

// A pair L1, L2 oriented alike, weighed by `share` (VII).
struct Pair {
  const Segment &first, &second;
  double share_1, share_2;
  Vector mean;  // the weighted average direction

  Pair(const Segment& a, const Segment& b) : first(a), second(b) {
    const double total = a.weight + b.weight;
    share_1 = a.weight / (total > 0 ? total : 1.0);
    share_2 = b.weight / (total > 0 ? total : 1.0);
    mean = share_1 * a.unit + share_2 * b.unit;
    const double length = size(mean);
    mean = 1.0 / (length > 0 ? length : 1.0) * mean;
  }

  double line_height(Vector direction) const {
    return share_1 * cross(direction, first.middle) + share_2 * cross(direction, second.middle);
  }
};

// parC (VII).
inline double parallelism(const Pair& pair, Vector direction) {
  double weighed = 0.0;
  for (const bool is_first : {true, false}) {
    const Segment& segment = is_first ? pair.first : pair.second;
    const double along = std::abs(dot(segment.along, direction));
    const double across = std::abs(cross(segment.along, direction));
    if (along <= kOrthogonal * segment.length) return kNever;
    weighed += (is_first ? pair.share_1 : pair.share_2) * (segment.length * across / along);
  }
  return weighed;
}

// colC (VII).
inline double collinearity(const Pair& pair) {
  const double height = pair.line_height(pair.mean);
  const auto away = [&](Vector end) { return std::abs(cross(pair.mean, end) - height); };
  return std::max(away(pair.first.start), away(pair.first.end)) +
         std::max(away(pair.second.start), away(pair.second.end));
}

inline double squared_distance(Vector end, const Segment& segment) {
  const double squared = segment.length * segment.length;
  const Vector offset = end - segment.start;
  const double share = dot(segment.along, offset) / (squared > 0 ? squared : 1.0);
  const Vector away = offset - std::min(std::max(share, 0.0), 1.0) * segment.along;
  return dot(away, away);
}

// proxC (VII).
inline double proximity(const Pair& pair) {
  return std::sqrt(std::min({squared_distance(pair.first.start, pair.second),
                             squared_distance(pair.first.end, pair.second),
                             squared_distance(pair.second.start, pair.first),
                             squared_distance(pair.second.end, pair.first)}));
}

inline double outer_end(double first, double second, const Pair& pair, double end_noise, bool high) {
  if (std::abs(first - second) <= end_noise) return first * pair.share_1 + second * pair.share_2;
  return high ? std::max(first, second) : std::min(first, second);
}

// What pairs cost and become, under the main directions of all segments (VI-A).
class Pairing {
 public:
  Rules rules;
  std::vector<double> mains;  // [rad], in [0, pi)

  Pairing(const Rules& given, std::vector<double> directions) : rules(given), mains(std::move(directions)) {
    for (const double angle : mains) units_.push_back({std::cos(angle), std::sin(angle)});
    least_cosine_ = std::cos(rules.max_angle);
    largest_sine_ = std::sin(std::min(rules.direction_tolerance, main_directions::kPeriod / 2));
  }

  // The merging direction ad (VI).
  Vector direction(const Pair& pair) const {
    const Vector* main = nullptr;
    double sine = kNever;
    for (const Vector& unit : units_) {
      const double difference = std::abs(cross(unit, pair.mean));
      if (difference < sine) sine = difference, main = &unit;
    }
    if (main == nullptr || sine > largest_sine_) return pair.mean;
    const double shift = std::max(pair.first.length, pair.second.length) / 2 * sine;
    return shift <= rules.max_shift ? *main : pair.mean;
  }

  // What merging costs [m], infinite where it is out of the question or dearer than `most`.
  double cost(const Segment& first, const Segment& second, double most) const {
    if (dot(first.along, second.along) < 0) return kNever;  // they show opposite faces
    if (!(dot(first.unit, second.unit) >= least_cosine_)) return kNever;
    const Pair pair(first, second);
    const double step = collinearity(pair);
    const double shorter = std::min(first.length, second.length);
    if (!(step <= rules.max_step + rules.turn_noise * shorter)) return kNever;
    const double opening = parallelism(pair, direction(pair));
    const double so_far = rules.parallelism * opening + rules.collinearity * step;
    if (!(so_far <= most && so_far <= rules.max_cost)) return kNever;
    const double gap = proximity(pair);
    if (!(gap <= rules.max_gap)) return kNever;
    const double cost = so_far + rules.proximity * gap;
    return cost <= most && cost <= rules.max_cost ? cost : kNever;
  }

  // ms(L1, L2, ad) (VII).
  Segment merged(const Segment& first, const Segment& second) const {
    const Pair pair(first, second);
    Vector ahead = direction(pair);
    if (dot(first.along, ahead) < 0) ahead = -1.0 * ahead;
    const double a = dot(ahead, first.start), b = dot(ahead, first.end);
    const double c = dot(ahead, second.start), d = dot(ahead, second.end);
    const double low = outer_end(std::min(a, b), std::min(c, d), pair, rules.end_noise, false);
    const double high = outer_end(std::max(a, b), std::max(c, d), pair, rules.end_noise, true);
    const double height = pair.line_height(ahead);
    const Vector foot{-height * ahead.y, height * ahead.x};
    return Segment::of(foot + low * ahead, foot + high * ahead, first.weight + second.weight);
  }

 private:
  std::vector<Vector> units_;
  double least_cosine_, largest_sine_;
};

}  // namespace merging
