// Oriented points in a grid: nearest neighbours in place and normal, and ICP on them.
// The twin and the words are in point_map.py.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <limits>
#include <optional>
#include <stdexcept>
#include <vector>

#include "arrays.hpp"
#include "sectors.hpp"

namespace point_map {

constexpr double kTurn = 6.283185307179586476925286766559;
constexpr double kHalfTurn = kTurn / 2;

inline double wrap(double angle) { return angle - kTurn * std::ceil((angle - kHalfTurn) / kTurn); }

struct Point {
  double x, y, u, v;  // place [m], normal times its weight [m]
  double nx, ny;      // unit normal
  int64_t number;     // in the order of adding
  int32_t tag;        // polyline, -1 for none
};

// Four numbers side by side, as wide registers take them; aligned as its numbers are, wherever fours are held.
typedef double Wide __attribute__((vector_size(32), aligned(8)));

// Four points; where there are fewer, the others are at infinity.
struct Four {
  Wide x, y, u, v;
};

// The two least squared distances to points, and the number of the point that the least is to.
struct LeastTwo {
  double least, second;
  size_t number;
};

// Of so many fours; where both are equal, the number is that of any of these points.
MAPWEAVE_WIDE inline LeastTwo least_two(const Four* fours, size_t count, double x, double y, double u, double v) {
  constexpr double kFar = std::numeric_limits<double>::infinity();
  Wide least = {kFar, kFar, kFar, kFar}, second = least, place = {0, 0, 0, 0};
  for (size_t k = 0; k < count; ++k) {
    const Four& four = fours[k];
    const Wide dx = four.x - x, dy = four.y - y, du = four.u - u, dv = four.v - v;
    const Wide d = dx * dx + dy * dy + (du * du + dv * dv);
    const auto nearer = d < least;
    const Wide farther = nearer ? least : d;
    second = farther < second ? farther : second;
    place = nearer ? Wide{} + static_cast<double>(k) : place;
    least = nearer ? d : least;
  }
  int best = 0;
  for (int e = 1; e < 4; ++e)
    if (least[e] < least[best]) best = e;
  double other = second[best];
  for (int e = 0; e < 4; ++e)
    if (e != best) other = std::min(other, least[e]);
  return {least[best], other, 4 * static_cast<size_t>(place[best]) + static_cast<size_t>(best)};
}

// The points of a cell of the grid, the same by fours, and between which numbers those are, in place and normal.
struct Cell {
  std::vector<Point> points;
  std::vector<Four> fours;
  Wide low = Wide{} + std::numeric_limits<double>::infinity(), high = -low;

  // [m²] squared distance below which no point is: walls that face another way are far, however near they lie.
  double least_possible(const Wide& at) const {
    const Wide below = low - at, above = at - high, most = below > above ? below : above;
    const Wide gap = most > 0.0 ? most : Wide{};
    const Wide squared = gap * gap;
    return squared[0] + squared[1] + (squared[2] + squared[3]);
  }

  LeastTwo least_two(double x, double y, double u, double v) const {
    return point_map::least_two(fours.data(), fours.size(), x, y, u, v);
  }

  void add(const Point& point) {
    points.push_back(point);
    lay_out(points.size() - 1);
  }

  void remove(int64_t number) {
    const auto gone = std::find_if(points.begin(), points.end(), [&](const Point& p) { return p.number == number; });
    lay_out(static_cast<size_t>(points.erase(gone) - points.begin()));
  }

 private:
  // Lays the points from one on out anew.
  void lay_out(size_t first) {
    fours.resize((points.size() + 3) / 4);
    low = Wide{} + std::numeric_limits<double>::infinity(), high = -low;
    for (const Point& point : points) {
      const Wide at = {point.x, point.y, point.u, point.v};
      low = at < low ? at : low, high = at > high ? at : high;
    }
    for (size_t k = first; k < 4 * fours.size(); ++k) {
      Four& four = fours[k / 4];
      const Point point = k < points.size() ? points[k] : Point{std::numeric_limits<double>::infinity()};  // or none
      four.x[k % 4] = point.x, four.y[k % 4] = point.y, four.u[k % 4] = point.u, four.v[k % 4] = point.v;
    }
  }
};

struct Known {
  double x, y, nx, ny;
  int64_t seen;  // block in which it was seen last; -1 once it is forgotten
};

// What is in sight: all up to `near` [m]; up to `far` what faces the sensor, by a cosine.
struct Sight {
  double near, far, facing;
};

struct Settings {
  double start_scale, end_scale, shrink, converged, noise;
  int max_iterations;
  int trial;     // iterations after which poor starts are dropped
  double share;  // of the best start's support that one must have by then
};

struct Fit {
  double x, y, turn;
  std::array<double, 9> information;
  double support;  // summed weight of the pairs
};

// The nearest point to a place, and how near another one can be.
struct Nearest {
  const Point* point;  // none within reach: null
  double others;       // [m²] squared distance below which no other point is
};

// A point's partner, when it was looked up last. While the point has moved less since than any other partner
// is farther away, it is still the nearest: so says the triangle's inequality, and nothing is looked up.
struct Partner {
  const Point* point = nullptr;
  const Point* guess = nullptr;  // the last that there was
  double x, y, u, v;             // where it was looked up from
  double others = -1;            // [m] below which no other point was; -1 before the first time

  const Point* again(double to_x, double to_y, double to_u, double to_v, double reach, bool& known) const {
    const double dx = x - to_x, dy = y - to_y, du = u - to_u, dv = v - to_v;
    const double room = others - std::sqrt(dx * dx + dy * dy + (du * du + dv * dv)) - 1e-9;
    known = false;
    if (room <= 0) return nullptr;
    if (!point) {
      known = room >= reach;
      return nullptr;
    }
    const double ax = point->x - to_x, ay = point->y - to_y, au = point->u - to_u, av = point->v - to_v;
    const double squared = ax * ax + ay * ay + (au * au + av * av);
    known = squared < room * room;
    return squared < reach * reach ? point : nullptr;
  }
};

// A start on its way.
struct Attempt {
  std::array<double, 3> start;
  Fit fit;
  double scale;
  int iterations = 0;
  bool settled = false;
  std::vector<Partner> partner;  // of each point, in the iteration before
};

// Solves the symmetric positive definite 3 x 3 system by Cholesky's factors.
inline std::array<double, 3> solve(const std::array<double, 9>& a, const std::array<double, 3>& b) {
  const double l00 = std::sqrt(a[0]), l10 = a[3] / l00, l20 = a[6] / l00;
  const double l11 = std::sqrt(a[4] - l10 * l10), l21 = (a[7] - l20 * l10) / l11;
  const double l22 = std::sqrt(a[8] - l20 * l20 - l21 * l21);
  const double y0 = b[0] / l00, y1 = (b[1] - l10 * y0) / l11;
  const double z2 = (b[2] - l20 * y0 - l21 * y1) / l22 / l22;
  const double z1 = (y1 - l21 * z2) / l11, z0 = (y0 - l10 * z1 - l20 * z2) / l00;
  return {z0, z1, z2};
}

class PointMap {
 public:
  PointMap(double normal_weight, double cell, double thin, int64_t blocks)
      : weight_(normal_weight), cell_(cell), thin_(thin), blocks_(blocks) {
    if (!(normal_weight > 0 && cell > 0 && thin >= 0 && blocks >= 1))
      throw std::invalid_argument("normal_weight, cell > 0, thin >= 0, blocks >= 1 expected");
  }

  int64_t size() const { return count_; }

  // Adds a block; a point like one that is there only renews it. Forgets what was not seen lately.
  void add(In<double, 2> points, In<double, 2> normals, std::optional<In<int64_t, 1>> tags) {
    const size_t n = check(points, normals);
    if (tags && tags->shape(0) != n) throw std::invalid_argument("tags: one a point expected");
    std::vector<Point> fresh;
    fresh.reserve(n);
    for (size_t i = 0; i < n; ++i) {
      const double* p = points.data() + 2 * i;
      const double* m = normals.data() + 2 * i;
      if (!(std::isfinite(p[0]) && std::isfinite(p[1]))) throw std::invalid_argument("points: finite numbers expected");
      Point point{p[0], p[1], weight_ * m[0], weight_ * m[1], m[0], m[1], 0, -1};
      if (tags) point.tag = static_cast<int32_t>(tags->data()[i]);
      const Point* like = thin_ > 0 ? nearest(point.x, point.y, point.u, point.v, thin_) : nullptr;
      if (like)
        renew(like->number);
      else
        fresh.push_back(point);
    }
    for (Point& point : fresh) {  // afterwards: a block's own points do not thin each other
      point.number = first_ + static_cast<int64_t>(known_.size());
      reach_out(point.x, point.y);
      cell_at(index(point.x) - left_, index(point.y) - low_).add(point);
      known_.push_back({point.x, point.y, point.nx, point.ny, block_});
      seen_in_.back().push_back(point.number);
      sample(point.number);
      ++count_;
    }
    ++block_;
    forget();
    seen_in_.emplace_back();
  }

  // (n,) distance to the nearest point, place and normal at once, and its number.
  std::tuple<Out<double>, Out<int64_t>> find(In<double, 2> points, In<double, 2> normals, double reach) const {
    const size_t n = check(points, normals);
    std::vector<double> distance(n, std::numeric_limits<double>::infinity());
    std::vector<int64_t> number(n, -1);
    for (size_t i = 0; i < n; ++i) {
      const double* p = points.data() + 2 * i;
      const double* m = normals.data() + 2 * i;
      const Point* found = nearest(p[0], p[1], weight_ * m[0], weight_ * m[1], reach);
      if (!found) continue;
      distance[i] = std::sqrt(squared(*found, p[0], p[1], weight_ * m[0], weight_ * m[1]));
      number[i] = found->number;
    }
    return std::make_tuple(give(std::move(distance), {n}), give(std::move(number), {n}));
  }

  // (k, n) which points have a partner within reach, at each pose.
  Out<bool> explains(In<double, 2> points, In<double, 2> normals, In<double, 2> poses, double reach) const {
    const size_t n = check(points, normals), k = check_poses(poses);
    auto* held = new std::unique_ptr<bool[]>(new bool[n * k]());
    nb::capsule owner(held, [](void* p) noexcept { delete static_cast<std::unique_ptr<bool[]>*>(p); });
    bool* out = held->get();
    for (size_t j = 0; j < k; ++j) {
      const double* pose = poses.data() + 3 * j;
      const double c = std::cos(pose[2]), s = std::sin(pose[2]);
      for (size_t i = 0; i < n; ++i) {
        out[j * n + i] = explains_one(points.data() + 2 * i, normals.data() + 2 * i, pose, c, s, reach);
      }
    }
    return Out<bool>(out, {k, n}, owner);
  }

  // Whether a point p with its normal m, moved to a pose, has a partner within reach; c and s are those of its turn.
  bool explains_one(const double* p, const double* m, const double* pose, double c, double s, double reach) const {
    const double x = pose[0] + c * p[0] - s * p[1], y = pose[1] + s * p[0] + c * p[1];
    const double u = weight_ * (c * m[0] - s * m[1]), v = weight_ * (s * m[0] + c * m[1]);
    return any_within(x, y, u, v, reach);
  }

  // Which (k,) starts were not dropped, the poses (k, 3) where the points come to lie from them, and what
  // holds them (k, 3, 3).
  std::tuple<Out<int64_t>, Out<double>, Out<double>> align(In<double, 2> points, In<double, 2> normals, In<double, 2> starts, In<double, 2> prior,
                  const Settings& p, std::optional<In<int64_t, 1>> tags,
                  std::optional<In<bool, 2>> corresponding) const {
    const size_t n = check(points, normals), k = check_poses(starts);
    if (prior.shape(0) != 3 || prior.shape(1) != 3) throw std::invalid_argument("prior: (3, 3) expected");
    if (bool(tags) != bool(corresponding) || (tags && tags->shape(0) != n))
      throw std::invalid_argument("tags, one a point, and corresponding come together");
    std::vector<Attempt> attempts;
    for (size_t j = 0; j < k; ++j) {
      const double* from = starts.data() + 3 * j;
      attempts.push_back({{from[0], from[1], from[2]}, {from[0], from[1], from[2], {}, 0}, p.start_scale});
      attempts.back().partner.resize(n);
    }
    const auto go_on = [&](Attempt& attempt, int until) {
      while (!attempt.settled && attempt.iterations < until)
        iterate(points.data(), normals.data(), n, attempt, prior.data(), p, tags ? tags->data() : nullptr,
                corresponding ? &*corresponding : nullptr);
    };
    double most = 0;
    for (Attempt& attempt : attempts) {
      go_on(attempt, std::min(p.trial, p.max_iterations));
      most = std::max(most, attempt.fit.support);
    }
    std::vector<int64_t> kept;
    std::vector<double> poses, information;
    for (size_t j = 0; j < k; ++j) {
      if (attempts[j].fit.support < p.share * most) continue;
      go_on(attempts[j], p.max_iterations);
      const Fit& fit = attempts[j].fit;
      kept.push_back(static_cast<int64_t>(j));
      poses.insert(poses.end(), {fit.x, fit.y, wrap(fit.turn)});
      information.insert(information.end(), fit.information.begin(), fit.information.end());
    }
    const size_t left = kept.size();
    return std::make_tuple(give(std::move(kept), {left}), give(std::move(poses), {left, 3}),
                          give(std::move(information), {left, 3, 3}));
  }

  // The number of the point that was added last; -1 before the first.
  int64_t newest() const { return first_ + static_cast<int64_t>(known_.size()) - 1; }

  // (n, 2) points and (n, 2) normals that are there, in the order of adding.
  std::tuple<Out<double>, Out<double>> content() const {
    std::vector<double> points, normals;
    for (const Known& q : known_) {
      if (q.seen < 0) continue;
      points.insert(points.end(), {q.x, q.y});
      normals.insert(normals.end(), {q.nx, q.ny});
    }
    const size_t n = points.size() / 2;
    return std::make_tuple(give(std::move(points), {n, 2}), give(std::move(normals), {n, 2}));
  }

  // (k,) of the points in sight from each pose, the share that lie before what the beams hit.
  Out<double> seen_through(In<double, 1> clear, double first, double spacing, In<double, 2> poses,
                           double clearance, double sight, double far_sight, double facing,
                           int64_t every) const {
    const size_t k = check_poses(poses);
    if (every < 1 || clear.shape(0) < 1) throw std::invalid_argument("every: 1 or more, clear: a beam or more expected");
    const sectors::Beams beams(clear.data(), static_cast<int64_t>(clear.shape(0)), first, spacing, clearance);
    std::vector<double> shares(k, 0.0);
    for (size_t j = 0; j < k; ++j) shares[j] = share_seen_through(beams, poses.data() + 3 * j, {sight, far_sight, facing}, every);
    return give(std::move(shares), {k});
  }

  PointMap copy() const { return *this; }

 private:
  // Of the points in sight from a pose, the share that lies before what the beams hit.
  double share_seen_through(const sectors::Beams& beams, const double* pose, const Sight& sight, int64_t every) const {
    const double c = std::cos(pose[2]), s = std::sin(pose[2]);
    const double near = sight.near * sight.near, far = sight.far * sight.far, facing = sight.facing * sight.facing;
    int64_t in_sight = 0, through = 0;
    for (const Known& q : sampled(every)) {
      const double dx = q.x - pose[0], dy = q.y - pose[1];
      const double squared = dx * dx + dy * dy;
      if (squared >= near) {
        if (squared >= far) continue;
        const double ahead = -(dx * q.nx + dy * q.ny);
        if (!(ahead > 0 && ahead * ahead > facing * squared)) continue;
      }
      ++in_sight;
      if (beams.before(c * dx + s * dy, c * dy - s * dx, squared)) ++through;
    }
    if (!in_sight) return 0.0;
    return static_cast<double>(through) / static_cast<double>(in_sight);
  }

  double weight_, cell_, thin_;
  int64_t blocks_, block_ = 0, count_ = 0, first_ = 0;
  std::deque<Known> known_;                             // by number, from first_ on
  std::deque<std::vector<int64_t>> seen_in_ = {{}};     // numbers seen in each of the last blocks
  int64_t left_ = 0, low_ = 0, columns_ = 0, rows_ = 0;  // the cells there are
  std::vector<int32_t> place_;  // of each cell in `cells_`, where it holds a point or did; -1 of most
  std::vector<Cell> cells_;
  std::vector<uint8_t> empty_;  // rings about each cell, itself the first, that hold no point for sure
  mutable std::vector<Known> sampled_;  // of the points that are there, those with a multiple of `every_`, if it is set
  mutable std::vector<int64_t> numbers_;  // of these
  mutable int64_t every_ = 0;

  // The points that are there whose number is a multiple of `every`, side by side.
  const std::vector<Known>& sampled(int64_t every) const {
    if (every_ == every) return sampled_;
    sampled_.clear(), numbers_.clear();
    every_ = every;
    for (size_t i = 0; i < known_.size(); ++i) sample(first_ + static_cast<int64_t>(i));
    return sampled_;
  }

  void sample(int64_t number) const {
    const Known& known = known_[static_cast<size_t>(number - first_)];
    if (every_ == 0 || number % every_ != 0 || known.seen < 0) return;
    sampled_.push_back(known), numbers_.push_back(number);
  }

  // Leaves out what is not there any more, of the numbers that are `gone`.
  void sample_less(std::vector<int64_t>& gone) const {
    if (every_ == 0 || gone.empty()) return;
    std::sort(gone.begin(), gone.end());
    size_t kept = 0, next = 0;
    for (size_t k = 0; k < numbers_.size(); ++k) {
      while (next < gone.size() && gone[next] < numbers_[k]) ++next;
      if (next < gone.size() && gone[next] == numbers_[k]) continue;
      sampled_[kept] = sampled_[k], numbers_[kept] = numbers_[k], ++kept;
    }
    sampled_.resize(kept), numbers_.resize(kept);
  }

  static size_t check(In<double, 2> points, In<double, 2> normals) {
    if (points.shape(1) != 2 || normals.shape(1) != 2 || points.shape(0) != normals.shape(0))
      throw std::invalid_argument("points and normals: (n, 2) each expected");
    return points.shape(0);
  }

  static size_t check_poses(In<double, 2> poses) {
    if (poses.shape(1) != 3) throw std::invalid_argument("poses: (k, 3) expected");
    return poses.shape(0);
  }

  static double squared(const Point& q, double x, double y, double u, double v) {
    const double dx = q.x - x, dy = q.y - y, du = q.u - u, dv = q.v - v;
    return dx * dx + dy * dy + (du * du + dv * dv);
  }

  int64_t index(double value) const { return floor_of(value / cell_); }
  size_t cell_of(double x, double y) const {
    return static_cast<size_t>((index(x) - left_) * rows_ + (index(y) - low_));
  }

  // The cell in a column and a row, made if there is none.
  Cell& cell_at(int64_t i, int64_t j) {
    int32_t& place = place_[static_cast<size_t>(i * rows_ + j)];
    if (place < 0) {
      place = static_cast<int32_t>(cells_.size());
      cells_.emplace_back();
      tell_around(i, j);
    }
    return cells_[static_cast<size_t>(place)];
  }

  // Calls `visit` with the column and the row of each cell that holds a point, and the cell.
  template <typename Visit>
  void occupied(Visit&& visit) {
    for (int64_t i = 0; i < columns_; ++i)
      for (int64_t j = 0; j < rows_; ++j) {
        const int32_t place = place_[static_cast<size_t>(i * rows_ + j)];
        if (place >= 0 && !cells_[place].points.empty()) visit(i, j, cells_[place]);
      }
  }

  // Tells the cells about one that it holds a point.
  void tell_around(int64_t i, int64_t j) {
    for (int64_t a = std::max<int64_t>(0, i - kRings); a <= std::min(columns_ - 1, i + kRings); ++a) {
      uint8_t* column = empty_.data() + a * rows_;
      for (int64_t b = std::max<int64_t>(0, j - kRings); b <= std::min(rows_ - 1, j + kRings); ++b)
        column[b] = std::min(column[b], static_cast<uint8_t>(std::max(std::abs(a - i), std::abs(b - j))));
    }
  }

  int64_t empty_rings(int64_t i, int64_t j) const {
    if (i < left_ || i >= left_ + columns_ || j < low_ || j >= low_ + rows_) return 0;
    return empty_[static_cast<size_t>((i - left_) * rows_ + (j - low_))];
  }

  // Makes room for a place outside: the grid grows by half its size at least.
  void reach_out(double x, double y) {
    const int64_t i = index(x), j = index(y);
    if (i >= left_ && i < left_ + columns_ && j >= low_ && j < low_ + rows_) return;
    const int64_t margin = kMargin;
    int64_t left = i - margin, right = i + margin, low = j - margin, high = j + margin;
    if (columns_ > 0) {
      left = std::min(left_, i < left_ ? i - margin - columns_ / 2 : left_);
      right = std::max(left_ + columns_, i >= left_ + columns_ ? i + margin + columns_ / 2 : left_ + columns_);
      low = std::min(low_, j < low_ ? j - margin - rows_ / 2 : low_);
      high = std::max(low_ + rows_, j >= low_ + rows_ ? j + margin + rows_ / 2 : low_ + rows_);
    }
    lay_out(left, low, right - left + 1, high - low + 1);
  }

  void lay_out(int64_t left, int64_t low, int64_t columns, int64_t rows) {
    if (columns > kMaxCells / rows) throw std::invalid_argument("points: spread over too wide an area");
    const size_t count = static_cast<size_t>(columns * rows);
    std::vector<int32_t> place(count, -1);
    std::vector<Cell> cells;
    occupied([&](int64_t i, int64_t j, Cell& cell) {
      place[static_cast<size_t>((i + left_ - left) * rows + (j + low_ - low))] = static_cast<int32_t>(cells.size());
      cells.push_back(std::move(cell));
    });
    place_ = std::move(place), cells_ = std::move(cells);
    left_ = left, low_ = low, columns_ = columns, rows_ = rows;
    empty_.assign(count, static_cast<uint8_t>(kRings + 1));
    occupied([&](int64_t i, int64_t j, const Cell&) { tell_around(i, j); });
  }

  void renew(int64_t number) {
    Known& known = known_[static_cast<size_t>(number - first_)];
    if (known.seen == block_) return;
    known.seen = block_;
    seen_in_.back().push_back(number);
  }

  // Forgets points that the last blocks did not see; gives back cells far from what is left.
  void forget() {
    if (static_cast<int64_t>(seen_in_.size()) <= blocks_) return;
    const int64_t oldest = block_ - static_cast<int64_t>(seen_in_.size());
    std::vector<int64_t> gone;
    for (const int64_t number : seen_in_.front()) {
      Known& known = known_[static_cast<size_t>(number - first_)];
      if (known.seen != oldest) continue;
      known.seen = -1;
      gone.push_back(number);
      cells_[place_[cell_of(known.x, known.y)]].remove(number);
      --count_;
    }
    sample_less(gone);
    seen_in_.pop_front();
    while (!known_.empty() && known_.front().seen < 0) known_.pop_front(), ++first_;
    if (block_ % blocks_ == 0) shrink();
  }

  void shrink() {
    int64_t first = columns_, last = -1, lowest = rows_, highest = -1;
    occupied([&](int64_t i, int64_t j, const Cell&) {
      first = std::min(first, i), last = std::max(last, i);
      lowest = std::min(lowest, j), highest = std::max(highest, j);
    });
    if (last < first) return;
    const int64_t columns = last - first + 1 + 2 * kMargin, rows = highest - lowest + 1 + 2 * kMargin;
    if (columns * rows * 2 < columns_ * rows_) lay_out(left_ + first - kMargin, low_ + lowest - kMargin, columns, rows);
  }

  // Calls `visit` with each cell of the ring of cells `r` away from (i, j) that may hold a point.
  template <typename Visit>
  void ring(int64_t i, int64_t j, int64_t r, Visit&& visit) const {
    const int64_t a0 = std::max(i - r, left_), a1 = std::min(i + r, left_ + columns_ - 1);
    const int64_t b0 = std::max(j - r, low_), b1 = std::min(j + r, low_ + rows_ - 1);
    for (int64_t a = a0; a <= a1; ++a) {
      const int32_t* place = place_.data() + (a - left_) * rows_ - low_;
      const uint8_t* empty = empty_.data() + (a - left_) * rows_ - low_;
      if (a == i - r || a == i + r) {
        for (int64_t b = b0; b <= b1; b += std::max<int64_t>(1, empty[b]))
          if (!empty[b]) visit(cells_[place[b]]);
      } else {
        if (j - r >= low_ && j - r < low_ + rows_ && !empty[j - r]) visit(cells_[place[j - r]]);
        if (r > 0 && j + r >= low_ && j + r < low_ + rows_ && !empty[j + r]) visit(cells_[place[j + r]]);
      }
    }
  }

  const Point* nearest(double x, double y, double u, double v, double reach) const {
    return nearest_two(x, y, u, v, reach, nullptr).point;
  }

  Nearest nearest_two(double x, double y, double u, double v, double reach, const Point* guess) const {
    const int64_t i = index(x), j = index(y);
    const double inner = std::min(std::min(x - i * cell_, (i + 1) * cell_ - x),
                                  std::min(y - j * cell_, (j + 1) * cell_ - y));
    double best = reach * reach, next = std::numeric_limits<double>::infinity();
    const Wide at = {x, y, u, v};
    const Point* found = nullptr;
    if (guess) {
      const double d = squared(*guess, x, y, u, v);
      if (d < best) best = d, found = guess;
    }
    // Whether a point is nearer than the nearest so far, or as near and was added before it.
    const auto compare = [&](const Point& q, double d) {
      if (&q == found) return;
      next = std::min(next, std::max(d, best));
      if (d < best || (d == best && found && q.number < found->number)) best = d, found = &q;
    };
    const int64_t farthest = std::max(std::max(i - left_, left_ + columns_ - 1 - i),
                                      std::max(j - low_, low_ + rows_ - 1 - j));
    for (int64_t r = empty_rings(i, j); r <= farthest; ++r) {
      const double gap = r == 0 ? 0.0 : inner + (r - 1) * cell_;  // nothing in this ring is nearer
      if (gap * gap > best || (r > 0 && gap >= reach)) {
        next = std::min(next, gap * gap);
        break;
      }
      ring(i, j, r, [&](const Cell& here) {
        const double nearest_here = here.least_possible(at);
        if (nearest_here > best) {
          next = std::min(next, nearest_here);
          return;
        }
        const LeastTwo two = here.least_two(x, y, u, v);
        if (two.least > best) {
          next = std::min(next, two.least);
        } else if (two.second == two.least) {
          for (const Point& q : here.points) compare(q, squared(q, x, y, u, v));
        } else {
          compare(here.points[two.number], two.least);
          next = std::min(next, two.second);
        }
      });
    }
    return {found, next};
  }

  const Point* partner_of(Partner& partner, double x, double y, double u, double v, double reach) const {
    bool known;
    const Point* same = partner.again(x, y, u, v, reach, known);
    if (known) return same;
    const Nearest found = nearest_two(x, y, u, v, reach, partner.guess);
    partner.point = found.point;
    if (found.point) partner.guess = found.point;
    partner.x = x, partner.y = y, partner.u = u, partner.v = v, partner.others = std::sqrt(found.others);
    return found.point;
  }

  bool any_within(double x, double y, double u, double v, double reach) const {
    const double limit = reach * reach;
    const Wide at = {x, y, u, v};
    const double wide = std::min(reach, 1e9 * cell_) + kRounding;
    const int64_t i0 = std::max(index(x - wide), left_), i1 = std::min(index(x + wide), left_ + columns_ - 1);
    const int64_t j0 = std::max(index(y - wide), low_), j1 = std::min(index(y + wide), low_ + rows_ - 1);
    for (int64_t i = i0; i <= i1; ++i)
      for (int64_t j = j0; j <= j1; ++j) {
        const int32_t place = place_[static_cast<size_t>((i - left_) * rows_ + (j - low_))];
        if (place < 0) continue;
        const Cell& here = cells_[place];
        if (here.least_possible(at) < limit && here.least_two(x, y, u, v).least < limit) return true;
      }
    return false;
  }

  // One step of Gauss and Newton, held by the prior.
  void iterate(const double* points, const double* normals, size_t n, Attempt& attempt, const double* prior,
               const Settings& p, const int64_t* tags, const In<bool, 2>* corresponding) const {
    Fit& fit = attempt.fit;
    std::array<double, 3> gradient{};
    linearise(points, normals, n, attempt, tags, corresponding, gradient);
    const std::array<double, 3> error{fit.x - attempt.start[0], fit.y - attempt.start[1],
                                      wrap(fit.turn - attempt.start[2])};
    const double per_noise = 1 / (p.noise * p.noise);
    std::array<double, 9> system, held;
    std::array<double, 3> force;
    for (int e = 0; e < 9; ++e) held[e] = prior[e] + (e % 4 == 0 ? kWeakest : 0.0);
    for (int e = 0; e < 9; ++e) system[e] = fit.information[e] * per_noise + held[e];
    for (int a = 0; a < 3; ++a)
      force[a] = gradient[a] * per_noise + (error[0] * held[a] + error[1] * held[3 + a] + error[2] * held[6 + a]);
    const std::array<double, 3> step = solve(system, force);
    fit.x -= step[0], fit.y -= step[1], fit.turn -= step[2];
    const double largest = std::max(std::abs(step[0]), std::max(std::abs(step[1]), std::abs(step[2])));
    attempt.settled = attempt.scale <= p.end_scale && largest < p.converged;
    attempt.scale = std::max(p.end_scale, attempt.scale * p.shrink);
    ++attempt.iterations;
  }

  // Normal matrix and gradient of the robust point-to-line cost (Geman-McClure) at a pose.
  void linearise(const double* points, const double* normals, size_t n, Attempt& attempt, const int64_t* tags,
                 const In<bool, 2>* corresponding, std::array<double, 3>& gradient) const {
    Fit& fit = attempt.fit;
    const double scale = attempt.scale;
    const double c = std::cos(fit.turn), s = std::sin(fit.turn);
    double xx = 0, xy = 0, xt = 0, yy = 0, yt = 0, tt = 0, gx = 0, gy = 0, gt = 0, support = 0;
    for (size_t i = 0; i < n; ++i) {
      const double* p = points + 2 * i;
      const double* m = normals + 2 * i;
      const double ax = c * p[0] - s * p[1], ay = s * p[0] + c * p[1];
      const double x = fit.x + ax, y = fit.y + ay;
      const double u = weight_ * (c * m[0] - s * m[1]), v = weight_ * (s * m[0] + c * m[1]);
      const Point* q = partner_of(attempt.partner[i], x, y, u, v, 3 * scale);
      if (!q) continue;
      if (corresponding) {
        if (q->tag < 0 || tags[i] < 0) continue;
        if (static_cast<size_t>(q->tag) >= corresponding->shape(0) ||
            static_cast<size_t>(tags[i]) >= corresponding->shape(1))
          throw std::invalid_argument("corresponding: smaller than the polylines named");
        if (!corresponding->data()[q->tag * corresponding->shape(1) + tags[i]]) continue;
      }
      const double pull = 1 + squared(*q, x, y, u, v) / (scale * scale);
      const double w = 1 / (pull * pull);
      support += w;
      const double residual = q->nx * (x - q->x) + q->ny * (y - q->y);
      const double turning = q->ny * ax - q->nx * ay;
      xx += w * q->nx * q->nx, xy += w * q->nx * q->ny, xt += w * q->nx * turning;
      yy += w * q->ny * q->ny, yt += w * q->ny * turning, tt += w * turning * turning;
      gx += w * q->nx * residual, gy += w * q->ny * residual, gt += w * turning * residual;
    }
    fit.information = {xx, xy, xt, xy, yy, yt, xt, yt, tt};
    fit.support = support;
    gradient = {gx, gy, gt};
  }

  static constexpr double kWeakest = 1e-6;  // [1/m², 1/rad²] so that a start without pairs stays
  static constexpr double kRounding = 1e-9;  // [m] by which places may err
  static constexpr int64_t kMargin = 16;  // cells around what is there
  static constexpr int64_t kRings = 6;    // about a point, whose cells know of it
  static constexpr int64_t kMaxCells = int64_t{1} << 26;
};

}  // namespace point_map

inline void bind_point_map(nb::module_& m) {
  using point_map::PointMap;
  using point_map::Settings;
  nb::class_<Settings>(m, "IcpSettings")
      .def("__init__",
           [](Settings* self, double start_scale, double end_scale, double shrink, double converged, double noise,
              int max_iterations, int trial, double share) {
             new (self) Settings{start_scale, end_scale, shrink, converged, noise, max_iterations, trial, share};
           },
           nb::arg("start_scale"), nb::arg("end_scale"), nb::arg("shrink"), nb::arg("converged"),
           nb::arg("noise"), nb::arg("max_iterations"), nb::arg("trial"), nb::arg("share"));
  nb::class_<PointMap>(m, "PointMap")
      .def(nb::init<double, double, double, int64_t>(), nb::arg("normal_weight"), nb::arg("cell"),
           nb::arg("thin"), nb::arg("blocks"))
      .def("__len__", &PointMap::size)
      .def("add", &PointMap::add, nb::arg("points"), nb::arg("normals"), nb::arg("tags") = nb::none())
      .def("find", &PointMap::find, nb::arg("points"), nb::arg("normals"), nb::arg("reach"))
      .def("explains", &PointMap::explains, nb::arg("points"), nb::arg("normals"), nb::arg("poses"),
           nb::arg("reach"))
      .def("align", &PointMap::align, nb::arg("points"), nb::arg("normals"), nb::arg("starts"), nb::arg("prior"),
           nb::arg("settings"), nb::arg("tags") = nb::none(), nb::arg("corresponding") = nb::none())
      .def_prop_ro("newest", &PointMap::newest)
      .def("content", &PointMap::content)
      .def("seen_through", &PointMap::seen_through, nb::arg("clear"), nb::arg("first"), nb::arg("spacing"),
           nb::arg("poses"), nb::arg("clearance"), nb::arg("sight"), nb::arg("far_sight"), nb::arg("facing"),
           nb::arg("every") = 1)
      .def("copy", &PointMap::copy)
      .def("__deepcopy__", [](const PointMap& self, nb::handle) { return self; }, nb::arg("memo"));
}
