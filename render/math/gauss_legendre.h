// Nodes and weights of Gauss-Legendre quadrature on [-1, 1], the half with positive nodes.
#pragma once

#include <array>

namespace lucerna {

struct QuadratureNode {
  double at, weight;
};
inline constexpr std::array<QuadratureNode, 2> kFourPoints = {
    {{0.33998104358485626, 0.65214515486254614}, {0.86113631159405258, 0.34785484513745386}}};
inline constexpr std::array<QuadratureNode, 4> kEightPoints = {
    {{0.18343464249564981, 0.36268378337836198},
     {0.52553240991632899, 0.31370664587788729},
     {0.79666647741362674, 0.22238103445337447},
     {0.96028985649753623, 0.10122853629037626}}};

}  // namespace lucerna
