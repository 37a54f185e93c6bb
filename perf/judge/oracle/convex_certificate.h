// Cheap proofs in double about two convex shapes: a plane between them, or points of their difference about the origin.
// They are for millions of pairs, and leave what is close to the judge.
#pragma once

#include "perf/judge/oracle/convex_judge.h"

#include <cstdint>

namespace cab::oracle {

enum class Proof : std::uint8_t { kNone, kApart, kTouching };

// What a search has found. Lengths are in the shapes' unit.
struct Certificate {
  Proof proof = Proof::kNone;
  Vec3<double> normal{};  // apart: of length 1 to rounding, from a to b; the shapes are apart along it
  double gap = 0;         // apart: by this much, to rounding, which is below kCertificateRounding of the size
};

// The rounding of a plane or of a point of the difference, in parts of the size N = |t| + Ra + Rb: the distance of the
// origins of the two shapes, and how far the shapes reach from them. Derived in convex_certificate.cpp.
inline constexpr double kCertificateRounding = 0x1p-47;

// Looks for a proof. kDecide stops at the first. kMeasure goes on until the gap of shapes that are apart is, to
// rounding, their distance. Half spaces get no proof. A pair that overlaps or is apart by less than some 1e-13 of its
// size gets none either, and now and then a pair that overlaps by little more.
Certificate certify(const JudgeShape& a, const JudgeShape& b, Effort effort);

// What is true of two shapes: by a certificate, else by the judge.
enum class Truth : std::uint8_t {
  kTooClose,  // their gap is within the judge's rounding of 0
  kApart,
  kTouching,
};
Truth truth_of(const JudgeShape& a, const JudgeShape& b);

}  // namespace cab::oracle
