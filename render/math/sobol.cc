#include "render/math/sobol.h"

#include <cstring>

#include "render/math/rng.h"

namespace lucerna {
namespace {

constexpr int kDimensions = kSobolDimensions;
// Eight lanes of 32 bits, one per dimension.
using Lanes = std::uint32_t __attribute__((vector_size(32)));

constexpr std::uint32_t ReverseBits(std::uint32_t v) {
  v = (v >> 16) | (v << 16);
  v = ((v & 0xFF00FF00U) >> 8) | ((v & 0x00FF00FFU) << 8);
  v = ((v & 0xF0F0F0F0U) >> 4) | ((v & 0x0F0F0F0FU) << 4);
  v = ((v & 0xCCCCCCCCU) >> 2) | ((v & 0x33333333U) << 2);
  return ((v & 0xAAAAAAAAU) >> 1) | ((v & 0x55555555U) << 1);
}

// Degree, inner coefficients and initial numbers of the primitive polynomial of each dimension
// after the first (which is van der Corput's). Source: Joe & Kuo 2008, "Constructing Sobol
// Sequences with Better Two-Dimensional Projections", table new-joe-kuo-6.
struct Polynomial {
  int degree;
  std::uint32_t coefficients;
  std::array<std::uint32_t, 5> initial;
};
constexpr std::array<Polynomial, kDimensions - 1> kPolynomials = {{
    {1, 0, {1}},
    {2, 1, {1, 3}},
    {3, 1, {1, 3, 1}},
    {3, 2, {1, 1, 1}},
    {4, 1, {1, 1, 3, 3}},
    {4, 4, {1, 3, 5, 13}},
    {5, 2, {1, 1, 5, 5, 17}},
}};

// Direction numbers of one dimension, each with its bits reversed: bit 0 counts halves.
constexpr std::array<std::uint32_t, 32> ReversedDirections(int dimension) {
  std::array<std::uint32_t, 32> m{};
  if (dimension == 0) {
    for (std::size_t i = 0; i < 32; ++i)
      m[i] = 1U << i;
    return m;
  }
  const Polynomial& polynomial = kPolynomials[static_cast<std::size_t>(dimension - 1)];
  const auto degree = static_cast<std::size_t>(polynomial.degree);
  std::array<std::uint32_t, 32> v{};
  for (std::size_t i = 0; i < 32; ++i) {
    if (i < degree) {
      v[i] = polynomial.initial[i] << (31 - i);
      continue;
    }
    v[i] = v[i - degree] ^ (v[i - degree] >> degree);
    for (std::size_t k = 1; k < degree; ++k) {
      if ((polynomial.coefficients >> (degree - 1 - k)) & 1U) v[i] ^= v[i - k];
    }
  }
  for (std::size_t i = 0; i < 32; ++i)
    m[i] = ReverseBits(v[i]);
  return m;
}

// [nibble of the index][its value][dimension]: what that nibble adds to the point.
struct NibbleTable {
  alignas(32) std::array<std::array<std::array<std::uint32_t, kDimensions>, 16>, 8> rows{};
};

constexpr NibbleTable MakeTable() {
  NibbleTable table;
  for (int dimension = 0; dimension < kDimensions; ++dimension) {
    const auto directions = ReversedDirections(dimension);
    for (std::size_t nibble = 0; nibble < 8; ++nibble) {
      for (std::size_t value = 0; value < 16; ++value) {
        std::uint32_t sum = 0;
        for (std::size_t bit = 0; bit < 4; ++bit) {
          if ((value >> bit) & 1U) sum ^= directions[4 * nibble + bit];
        }
        table.rows[nibble][value][static_cast<std::size_t>(dimension)] = sum;
      }
    }
  }
  return table;
}

constexpr NibbleTable kTable = MakeTable();

Lanes Load(const std::array<std::uint32_t, kDimensions>& row) {
  Lanes lanes;
  std::memcpy(&lanes, row.data(), sizeof(lanes));
  return lanes;
}

// On reversed bits, a carry runs from a digit to the finer ones only, which is what nested
// uniform scrambling asks of a hash. Constants: Burley 2020, listing 3.
template <typename T>
T ScrambleReversed(T v, T seed) {
  v ^= v * 0x3D20ADEAU;
  v += seed;
  v *= (seed >> 16) | 1U;
  v ^= v * 0x05526C56U;
  v ^= v * 0x53A22864U;
  return v;
}

Lanes ReverseLanes(Lanes v) {
  v = (v >> 16) | (v << 16);
  v = ((v & 0xFF00FF00U) >> 8) | ((v & 0x00FF00FFU) << 8);
  v = ((v & 0xF0F0F0F0U) >> 4) | ((v & 0x0F0F0F0FU) << 4);
  v = ((v & 0xCCCCCCCCU) >> 2) | ((v & 0x33333333U) << 2);
  return ((v & 0xAAAAAAAAU) >> 1) | ((v & 0x55555555U) << 1);
}

SobolPoint Point(std::uint32_t index, std::uint64_t key) {
  Lanes sum = {};
  for (std::size_t nibble = 0; nibble < 8; ++nibble) {
    sum ^= Load(kTable.rows[nibble][(index >> (4 * nibble)) & 15U]);
  }
  Lanes seed;
  std::array<std::uint64_t, 4> seeds{};
  for (std::size_t i = 0; i < 4; ++i)
    seeds[i] = Mix64(key + (i + 1) * 0x9E3779B97F4A7C15ULL);
  std::memcpy(&seed, seeds.data(), sizeof(seed));
  const Lanes scrambled = ReverseLanes(ScrambleReversed(sum, seed));
  using SignedLanes = std::int32_t __attribute__((vector_size(32)));
  using FloatLanes = float __attribute__((vector_size(32)));
  const auto top = reinterpret_cast<SignedLanes>(scrambled >> 8);
  const FloatLanes unit = __builtin_convertvector(top, FloatLanes) * 0x1p-24F;
  SobolPoint point;
  std::memcpy(point.data(), &unit, sizeof(unit));
  return point;
}

std::uint64_t KeyOfPeriod(std::uint64_t index, std::uint64_t key) {
  const std::uint64_t period = index >> 32;
  return period == 0 ? key : CombineKeys(key, period);
}

}  // namespace

SobolPoint OwenSobol(std::uint64_t index, std::uint64_t key) {
  return Point(static_cast<std::uint32_t>(index), KeyOfPeriod(index, key));
}

SobolPoint ShuffledOwenSobol(std::uint64_t index, std::uint64_t key) {
  const std::uint64_t period_key = KeyOfPeriod(index, key);
  const auto seed = static_cast<std::uint32_t>(Mix64(period_key) >> 32);
  const std::uint32_t shuffled =
      ReverseBits(ScrambleReversed(ReverseBits(static_cast<std::uint32_t>(index)), seed));
  return Point(shuffled, period_key);
}

std::uint32_t SobolDigits(std::uint32_t index, int dimension) {
  Lanes sum = {};
  for (std::size_t nibble = 0; nibble < 8; ++nibble)
    sum ^= Load(kTable.rows[nibble][(index >> (4 * nibble)) & 15U]);
  return ReverseBits(sum[dimension]);
}

}  // namespace lucerna
