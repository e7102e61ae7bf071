// Three-component vectors of plain data, usable in host and device code.
//
// Kept free of Eigen and of the standard library's containers so that per-element bodies compile
// unchanged with g++ and nvcc; host code that needs linear algebra converts to Eigen locally.
#pragma once

#include <cmath>

#if defined(__CUDACC__)
#define AMHEX_HD __host__ __device__
#else
#define AMHEX_HD
#endif

namespace amhex {

template <class T>
struct Vec3 {
  T x = 0, y = 0, z = 0;

  AMHEX_HD constexpr T operator[](int axis) const { return axis == 0 ? x : (axis == 1 ? y : z); }
  AMHEX_HD constexpr T& operator[](int axis) { return axis == 0 ? x : (axis == 1 ? y : z); }

  AMHEX_HD constexpr Vec3& operator+=(const Vec3& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  AMHEX_HD constexpr Vec3& operator-=(const Vec3& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  AMHEX_HD constexpr Vec3& operator*=(T s) {
    x *= s, y *= s, z *= s;
    return *this;
  }
  AMHEX_HD constexpr Vec3& operator/=(T s) {
    x /= s, y /= s, z /= s;
    return *this;
  }
  friend AMHEX_HD constexpr Vec3 operator+(Vec3 a, const Vec3& b) { return a += b; }
  friend AMHEX_HD constexpr Vec3 operator-(Vec3 a, const Vec3& b) { return a -= b; }
  friend AMHEX_HD constexpr Vec3 operator-(const Vec3& a) { return {-a.x, -a.y, -a.z}; }
  friend AMHEX_HD constexpr Vec3 operator*(Vec3 a, T s) { return a *= s; }
  friend AMHEX_HD constexpr Vec3 operator*(T s, Vec3 a) { return a *= s; }
  friend AMHEX_HD constexpr Vec3 operator/(Vec3 a, T s) { return a /= s; }
  friend AMHEX_HD constexpr bool operator==(const Vec3& a, const Vec3& b) {
    return a.x == b.x && a.y == b.y && a.z == b.z;
  }
};

using Vec3d = Vec3<double>;
using Vec3f = Vec3<float>;

template <class T>
AMHEX_HD constexpr T Dot(const Vec3<T>& a, const Vec3<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

template <class T>
AMHEX_HD constexpr Vec3<T> Cross(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Six times the signed volume of the tetrahedron (origin, a, b, c).
template <class T>
AMHEX_HD constexpr T Determinant(const Vec3<T>& a, const Vec3<T>& b, const Vec3<T>& c) {
  return Dot(a, Cross(b, c));
}

template <class T>
AMHEX_HD constexpr T SquaredNorm(const Vec3<T>& a) {
  return Dot(a, a);
}

template <class T>
AMHEX_HD inline T Norm(const Vec3<T>& a) {
  return std::sqrt(Dot(a, a));
}

// Unit vector along `a`; the zero vector stays zero.
template <class T>
AMHEX_HD inline Vec3<T> Normalized(const Vec3<T>& a) {
  const T length = Norm(a);
  return length > T(0) ? a / length : a;
}

template <class T>
AMHEX_HD constexpr Vec3<T> ComponentMin(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x < b.x ? a.x : b.x, a.y < b.y ? a.y : b.y, a.z < b.z ? a.z : b.z};
}

template <class T>
AMHEX_HD constexpr Vec3<T> ComponentMax(const Vec3<T>& a, const Vec3<T>& b) {
  return {a.x > b.x ? a.x : b.x, a.y > b.y ? a.y : b.y, a.z > b.z ? a.z : b.z};
}

// Axis-aligned box; empty until the first Extend.
struct Box3d {
  Vec3d low{1e300, 1e300, 1e300};
  Vec3d high{-1e300, -1e300, -1e300};

  void Extend(const Vec3d& p) {
    low = ComponentMin(low, p);
    high = ComponentMax(high, p);
  }
  bool IsEmpty() const { return low.x > high.x; }
  Vec3d Extent() const { return high - low; }
  double Diagonal() const { return IsEmpty() ? 0.0 : Norm(high - low); }
};

}  // namespace amhex
