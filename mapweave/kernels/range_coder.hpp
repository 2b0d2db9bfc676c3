// An adaptive binary range coder, and its decoder. The twin and the words are in range_coder.py.
#pragma once
#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

namespace range_coder {

namespace nb = nanobind;

constexpr int MAX_BITS = 62;
constexpr int MOST_COUNTED = 500;
constexpr int PRECISION = 15;
constexpr int FLUSHED = 5;
constexpr int64_t NUMBERS_OF_A_BYTE = 8, NUMBERS_OF_NONE = 1000;
constexpr uint32_t TOP = 1u << 24;

using Counts = std::array<int32_t, 2>;
using Beginning = nb::typed<nb::dict, nb::str, nb::object>;

inline int64_t as_number(nb::handle value) {
  const nb::object whole = nb::steal(PyNumber_Index(value.ptr()));
  if (!whole.is_valid()) throw nb::python_error();
  int overflow = 0;
  const long long number = PyLong_AsLongLongAndOverflow(whole.ptr(), &overflow);
  if (overflow || number == INT64_MAX || number == INT64_MIN)
    throw std::invalid_argument("a number of more than " + std::to_string(MAX_BITS) + " bits");
  return number;
}

// The parts of a context in a row, such as "aside 1 0 3".
inline std::string name_of(nb::handle context) {
  if (!PyTuple_Check(context.ptr())) {
    if (PyUnicode_Check(context.ptr())) return nb::cast<std::string>(context);
    return std::to_string(as_number(context));
  }
  std::string name;
  for (const nb::handle part : nb::borrow<nb::tuple>(context)) {
    if (!name.empty()) name += ' ';
    name += name_of(part);
  }
  return name;
}

// The counts of all decisions that one context names; they begin when they are needed.
class Context {
 public:
  explicit Context(nb::handle context) : name_(name_of(context)) {}

  Counts& decision(nb::handle beginning) { return at(0, beginning, ""); }
  Counts& sign(nb::handle beginning) { return at(1, beginning, " sign"); }
  Counts& more(int bits, nb::handle beginning) {
    return at(2 + 2 * bits, beginning, bits, "");
  }
  Counts& leading(int bits, nb::handle beginning) {
    return at(3 + 2 * bits, beginning, bits, " 1");
  }

 private:
  Counts& at(size_t slot, nb::handle beginning, int bits, const char* behind) {
    if (slot < counts_.size() && counts_[slot][0]) return counts_[slot];
    return at(slot, beginning, " " + std::to_string(bits) + behind);
  }

  Counts& at(size_t slot, nb::handle beginning, const std::string& behind) {
    if (slot >= counts_.size()) counts_.resize(slot + 1, Counts{0, 0});
    Counts& counts = counts_[slot];
    if (counts[0]) return counts;
    counts = {1, 1};
    const nb::str name((name_ + behind).c_str());
    if (PyObject* found = PyDict_GetItemWithError(beginning.ptr(), name.ptr())) {
      const nb::handle pair(found);
      counts = {nb::cast<int32_t>(pair[0]), nb::cast<int32_t>(pair[1])};
    } else if (PyErr_Occurred()) {
      throw nb::python_error();
    }
    return counts;
  }

  std::string name_;
  std::vector<Counts> counts_;  // {0, 0}: not begun
};

inline void learn(Counts& counts, int value) {
  counts[value] += 2;
  if (counts[0] + counts[1] > MOST_COUNTED)
    counts = {(counts[0] + 1) >> 1, (counts[1] + 1) >> 1};
}

// What numbers are made of, for both ends: `End` codes a decision, an even bit, and its budget.
template <typename End>
class Coder {
 public:
  explicit Coder(Beginning beginning) : beginning_(std::move(beginning)) {}

  int64_t numbers() const { return numbers_; }

  int bit(nb::handle context, nb::handle value) {
    Counts& counts = of(context).decision(beginning_);
    return end().decide(counts, as_number(value) != 0);
  }

  int even(nb::handle value) { return end().halve(as_number(value) != 0); }

  int64_t unsigned_number(nb::handle context, nb::handle value) {
    return magnitude(of(context), as_number(value));
  }

  int64_t signed_number(nb::handle context, nb::handle value) {
    const int64_t number = as_number(value);
    Context& counted = of(context);
    const int64_t found = magnitude(counted, number < 0 ? -number : number);
    const bool negative = found && end().decide(counted.sign(beginning_), number < 0);
    return negative ? -found : found;
  }

  int64_t count(nb::handle context, int64_t limit, nb::handle value) {
    const int64_t found = unsigned_number(context, value);
    if (found > limit)
      throw std::invalid_argument(std::to_string(found) + " in a row, expected at most " +
                                  std::to_string(limit));
    return found;
  }

 protected:
  // Copies share no counts: the dictionary of one may grow while the other's stays.
  Coder(const Coder& other)
      : range_(other.range_), numbers_(other.numbers_), beginning_(other.beginning_),
        known_(other.known_), contexts_(other.contexts_) {
    places_ = nb::steal<nb::dict>(PyDict_Copy(other.places_.ptr()));
  }

  uint32_t split(const Counts& counts) const {
    const uint32_t share = (static_cast<uint32_t>(counts[1]) << PRECISION) /
                           static_cast<uint32_t>(counts[0] + counts[1]);
    return (range_ >> PRECISION) * std::max(1u, share);
  }

  uint32_t range_ = 0xFFFFFFFFu;
  int64_t numbers_ = 0;

 private:
  End& end() { return static_cast<End&>(*this); }

  Context& of(nb::handle context) {
    if (PyObject* found = PyDict_GetItemWithError(places_.ptr(), context.ptr()))
      return contexts_[PyLong_AsSize_t(found)];
    if (PyErr_Occurred()) throw nb::python_error();
    contexts_.emplace_back(context);
    places_[context] = known_;
    return contexts_[known_++];
  }

  // An exponential Golomb code: the length first.
  int64_t magnitude(Context& counted, int64_t value) {
    end().spend();
    const int64_t wanted = value + 1;
    int bits = 0;
    while (end().decide(counted.more(bits, beginning_), bits < MAX_BITS && (wanted >> (bits + 1)) > 0)) {
      if (++bits > MAX_BITS)
        throw std::invalid_argument("a number of more than " + std::to_string(MAX_BITS) + " bits");
    }
    int64_t found = 1;
    for (int place = bits - 1; place >= 0; --place) {
      const int digit = static_cast<int>(wanted >> place & 1);
      found = 2 * found + (place == bits - 1 ? end().decide(counted.leading(bits, beginning_), digit)
                                             : end().halve(digit));
    }
    return found - 1;
  }

  Beginning beginning_;
  size_t known_ = 0;
  nb::dict places_;  // of each context in `contexts_`
  std::vector<Context> contexts_;
};

class Encoder : public Coder<Encoder> {
 public:
  Encoder(Beginning beginning, int64_t limit) : Coder(std::move(beginning)), limit_(limit) {}

  Encoder copy() const { return *this; }

  int decide(Counts& counts, int value) {
    const uint32_t part = split(counts);
    if (value) {
      range_ = part;
    } else {
      low_ += part;
      range_ -= part;
    }
    learn(counts, value);
    renormalise();
    return value;
  }

  int halve(int value) {
    range_ >>= 1;
    if (value) low_ += range_;
    renormalise();
    return value;
  }

  void spend() {
    if (++numbers_ > limit_)
      throw std::invalid_argument("more than " + std::to_string(limit_) + " numbers");
  }

  // Zeros at the end are left off, but for those that allow for the number of numbers.
  nb::bytes finish() {
    low_ = (low_ + TOP - 1) & ~static_cast<uint64_t>(TOP - 1);
    for (int k = 0; k < FLUSHED; ++k) shift();
    std::string payload = bytes_;
    payload.erase(payload.find_last_not_of('\0') + 1);
    const int64_t beyond = numbers_ - NUMBERS_OF_NONE;
    const int64_t least = beyond > 0 ? (beyond + NUMBERS_OF_A_BYTE - 1) / NUMBERS_OF_A_BYTE : 0;
    if (static_cast<int64_t>(payload.size()) < least) payload.resize(least, '\0');
    return nb::bytes(payload.data(), payload.size());
  }

 private:
  void renormalise() {
    while (range_ < TOP) {
      range_ <<= 8;
      shift();
    }
  }

  // Move the uppermost byte out, or keep it while a carry may still come.
  void shift() {
    const int carry = static_cast<int>(low_ >> 32), upper = static_cast<int>(low_ >> 24 & 0xFF);
    if (carry || upper < 0xFF) {
      if (held_ >= 0) bytes_ += static_cast<char>(held_ + carry & 0xFF);
      bytes_.append(pending_, static_cast<char>(0xFF + carry & 0xFF));
      held_ = upper;
      pending_ = 0;
    } else {
      ++pending_;
    }
    low_ = low_ << 8 & 0xFFFFFFFFu;
  }

  int64_t limit_;
  uint64_t low_ = 0;
  int held_ = -1;       // a byte that a carry may still change
  size_t pending_ = 0;  // bytes of 255 after it
  std::string bytes_;
};

class Decoder : public Coder<Decoder> {
 public:
  Decoder(nb::bytes data, Beginning beginning, int64_t allowed)
      : Coder(std::move(beginning)), data_(data.c_str(), data.size()), allowed_(allowed) {
    for (int k = 0; k < 4; ++k) code_ = code_ << 8 | next();
  }

  int decide(Counts& counts, int) {
    const uint32_t part = split(counts);
    const int value = code_ < part;
    if (value) {
      range_ = part;
    } else {
      code_ -= part;
      range_ -= part;
    }
    learn(counts, value);
    renormalise();
    return value;
  }

  int halve(int) {
    range_ >>= 1;
    const int value = code_ >= range_;
    if (value) code_ -= range_;
    renormalise();
    return value;
  }

  void spend() {
    if (++numbers_ > allowed_)
      throw std::invalid_argument("more than " + std::to_string(allowed_) + " numbers in " +
                                  std::to_string(data_.size()) + " bytes");
  }

 private:
  uint32_t next() { return at_ < data_.size() ? static_cast<uint8_t>(data_[at_++]) : 0; }

  void renormalise() {
    while (range_ < TOP) {
      range_ <<= 8;
      code_ = code_ << 8 | next();
    }
  }

  std::string data_;
  int64_t allowed_;
  size_t at_ = 0;
  uint32_t code_ = 0;
};

}  // namespace range_coder

template <typename End, typename Bound>
void bind_coder(Bound& bound) {
  namespace nb = nanobind;
  bound.def_prop_ro("numbers", &End::numbers)
      .def("bit", &End::bit, nb::arg("context"), nb::arg("value") = 0)
      .def("even", &End::even, nb::arg("value") = 0)
      .def("unsigned", &End::unsigned_number, nb::arg("context"), nb::arg("value") = 0)
      .def("signed", &End::signed_number, nb::arg("context"), nb::arg("value") = 0)
      .def("count", &End::count, nb::arg("context"), nb::arg("limit"), nb::arg("value") = 0);
}

inline void bind_range_coder(nanobind::module_& m) {
  namespace nb = nanobind;
  using namespace range_coder;
  auto encoder = nb::class_<Encoder>(m, "RangeEncoder");
  encoder.def(nb::init<Beginning, int64_t>(), nb::arg("beginning"), nb::arg("limit"))
      .def("finish", &Encoder::finish)
      .def("copy", &Encoder::copy);
  bind_coder<Encoder>(encoder);
  auto decoder = nb::class_<Decoder>(m, "RangeDecoder");
  decoder.def(nb::init<nb::bytes, Beginning, int64_t>(), nb::arg("data"), nb::arg("beginning"),
              nb::arg("allowed"));
  bind_coder<Decoder>(decoder);
}
