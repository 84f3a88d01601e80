// A colour: three floats, linear Rec. 709 in scenes and images and the working space of
// math/color_space.h in transport. What it measures (flux, radiance, reflectance) is said by the
// name of the variable.
#pragma once

#include <algorithm>
#include <cmath>

namespace lucerna {

struct Rgb {
  float r = 0, g = 0, b = 0;

  constexpr float operator[](int channel) const { return channel == 0 ? r : channel == 1 ? g : b; }
  constexpr bool operator==(const Rgb&) const = default;
  constexpr Rgb& operator+=(Rgb o) { return *this = {r + o.r, g + o.g, b + o.b}; }
  constexpr Rgb& operator*=(Rgb o) { return *this = {r * o.r, g * o.g, b * o.b}; }
  constexpr Rgb& operator*=(float s) { return *this = {r * s, g * s, b * s}; }
};

constexpr Rgb operator+(Rgb a, Rgb b) {
  return {a.r + b.r, a.g + b.g, a.b + b.b};
}
constexpr Rgb operator-(Rgb a, Rgb b) {
  return {a.r - b.r, a.g - b.g, a.b - b.b};
}
constexpr Rgb operator*(Rgb a, Rgb b) {
  return {a.r * b.r, a.g * b.g, a.b * b.b};
}
constexpr Rgb operator*(Rgb a, float s) {
  return {a.r * s, a.g * s, a.b * s};
}
constexpr Rgb operator*(float s, Rgb a) {
  return a * s;
}
constexpr Rgb operator/(Rgb a, float s) {
  return a * (1.0F / s);
}
constexpr Rgb Gray(float v) {
  return {v, v, v};
}

// Of a Rec. 709 colour; of a working-space colour, a weight about as large.
constexpr float Luminance(Rgb c) {
  return 0.2126F * c.r + 0.7152F * c.g + 0.0722F * c.b;
}
constexpr float MaxChannel(Rgb c) {
  return std::max(c.r, std::max(c.g, c.b));
}
constexpr bool IsBlack(Rgb c) {
  return c.r == 0 && c.g == 0 && c.b == 0;
}
// Zero times a number is zero, unless the number is infinite or none: one comparison for all three.
constexpr bool IsFinite(Rgb c) {
  return c.r * 0 + c.g * 0 + c.b * 0 == 0;
}

}  // namespace lucerna
