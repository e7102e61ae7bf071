// Means of frames that do not depend on how their axes are named.
//
// A frame with the axes a_0, a_1, a_2 stands for the quartic form P(x) = sum (a_k . x)^4: equal for
// all 24 namings, so forms of neighbours may simply be added. The frame nearest to a sum of forms
// maximises P(a_0) + P(a_1) + P(a_2). Compared with a running mean of matched quaternions nothing
// depends on the order of the neighbours, and frames that disagree by 45 degrees do not pull at
// all; the fields come out with fewer and better placed singularities.
#pragma once

#include <array>

#include "amhex/vec3.h"
#include "base/vector_lanes.h"
#include "fields/octahedral_group.h"

namespace amhex::fields {

// Coefficients, binomial factors included, of x^4 y^4 z^4, x^3y x^3z y^3x y^3z z^3x z^3y,
// x^2y^2 x^2z^2 y^2z^2, x^2yz xy^2z xyz^2; a sixteenth that is always zero fills the vector.
struct QuarticForm {
  std::array<float, 16> coefficients{};

  void Add(const QuarticForm& other, float weight) {
    for (int k = 0; k < 16; ++k) coefficients[k] += weight * other.coefficients[k];
  }
  // Of P at x.
  Vec3d Gradient(const Vec3d& x) const;
};

QuarticForm FormOfFrame(const Quaternion& frame);

// (axis . x)^4.
QuarticForm FormOfAxis(const Vec3d& axis);

// `start` moved towards the frame nearest to `form` by so many rounds of the ascent that replaces
// the axes by the rotation nearest to their gradients. Every round raises P(a_0) + P(a_1) + P(a_2)
// (P is convex); the error falls with its third power where the summed frames agree. Returns
// `start` for a form without preference.
Quaternion NearestFrame(const QuarticForm& form, const Quaternion& start, int rounds);

// The same for several forms at once, to the bit.
struct FrameBatch {
  std::array<QuarticForm, kLanes> forms;
  std::array<Quaternion, kLanes> frames;  // start, then result
};
void FindNearestFrames(int rounds, FrameBatch* batch);

// Rotation nearest to the matrix with these columns (Newton's iteration); false if their
// determinant is not clearly positive for columns of about unit length.
bool NearestRotationMatrix(AxisFrame* columns);

}  // namespace amhex::fields
