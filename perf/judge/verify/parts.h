// The parts of `cab verify`. Each part judges the library exactly, by regimes (kinds of hard inputs) and methods (sets
// of policies). A round runs every regime of every part once. Its inputs depend only on the seed and on the round's
// number.
#pragma once

#include <cab/cab.h>
#include <cab/collision_checker.h>

#include <cstdint>
#include <string>
#include <vector>

#include "engine/exact/convex_in_double.h"
#include "engine/exact/surface.h"
#include "kernels/find_kernels.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "perf/judge/oracle/oracle_box.h"
#include "perf/judge/oracle/random.h"

namespace cab::perf {

// The functions that are verified: those of the library or, in a test, functions with a deliberate fault.
struct Subject {
  const kernel::KernelTable* kernels = nullptr;  // its isa is that of the engines too
  decltype(&cab::compute_boxes) compute_boxes = cab::compute_boxes;
  decltype(&cab::run_frame) run_frame = cab::run_frame;
  decltype(&cab::answer_in_double) answer_in_double = cab::answer_in_double;
  decltype(&cab::run_queries) run_queries = cab::run_queries;
  // The one that a frame calls for two leaves.
  void (*find_touching_triangles)(const FrameContext& frame, const ExactLeaf& a, const ExactLeaf& b, float margin,
                                  SkinCache& cache, FrameStats& stats, void* taker,
                                  TakeTouching take) = cab::find_touching_triangles;
  // CollisionChecker::check_motions.
  Status (*check_motions)(CollisionChecker& checker, Span<const double> from, Span<const double> to,
                          Span<MotionAnswer> answers, MotionSearch& search) =
      [](CollisionChecker& checker, Span<const double> from, Span<const double> to, Span<MotionAnswer> answers,
         MotionSearch& search) { return checker.check_motions(from, to, answers, search); };
};

// The counts of one row. They are only sums and maxima, so they depend on nothing but which rounds ran.
struct Tally {
  std::uint64_t judged = 0;      // what the part counts
  std::uint64_t violations = 0;  // whatever breaks a promise: a box that does not contain what it must, a lost pair
  std::uint64_t touching = 0;    // pairs or motions that the judge calls touching; links that queries must find
  // Pairs or motions called touching that the judge calls apart; links that queries may not find.
  std::uint64_t false_positives = 0;
  std::uint64_t differing = 0;        // pairs, or calls, that another strategy or instruction set answers otherwise
  std::uint64_t false_apart = 0;      // pairs of shapes that touch and were called apart
  std::uint64_t undecided = 0;        // pairs that the kernels, or the quick judge of queries, leave open; motions, and
                                      // pairs of balls and capsules, that the judge does
  std::uint64_t still_undecided = 0;  // those of them that the test in double leaves open
  std::uint64_t unclear = 0;          // pairs of triangles that the judge cannot tell from touching
  std::uint64_t contacts = 0;         // contacts that were judged
  std::uint64_t above_1 = 0;          // contacts that are more than 1 % deeper than the least depth
  std::uint64_t above_10 = 0;         // more than 10 %
  std::uint64_t hits = 0;             // links that queries have found
  std::uint64_t lost = 0;             // links that queries must find and have not; motions called free that
                                      // touch; triangles that touch and are not found
  std::uint64_t pairs = 0;            // queries and leaves that were judged
  std::uint64_t free = 0, colliding = 0, too_close = 0;  // motions by their answers
  double off = 0;          // largest by which the point of a hit is off its leaf as given, or a depth off the true one,
                           // in u of the lengths
  double widest_gap = 0;   // of shapes that are apart and were called touching, in parts of what a gap may be
  double excess = -1e300;  // largest by which a corner leaves its box, in ulps of size u (S + M); negative: inside
  double axes = 0;         // largest |R^T R - I| of a box that was made, in u
  // The merge in which rounding took the largest share of the padding: the share, and both in ulps of size.
  double share = -1e300, rounding = 0, padding = 0;

  void add(const Tally& other);
};

// The counts and the maxima of a tally by the names that they have in a file.
struct NamedCount {
  const char* name;
  std::uint64_t Tally::*count;
};
inline constexpr NamedCount kCounts[] = {{"judged", &Tally::judged},
                                         {"violations", &Tally::violations},
                                         {"touching", &Tally::touching},
                                         {"false_positives", &Tally::false_positives},
                                         {"differing", &Tally::differing},
                                         {"false_apart", &Tally::false_apart},
                                         {"undecided", &Tally::undecided},
                                         {"still_undecided", &Tally::still_undecided},
                                         {"undecided_by_judge", &Tally::unclear},
                                         {"contacts", &Tally::contacts},
                                         {"contacts_above_1_percent", &Tally::above_1},
                                         {"contacts_above_10_percent", &Tally::above_10},
                                         {"hits", &Tally::hits},
                                         {"lost", &Tally::lost},
                                         {"pairs", &Tally::pairs},
                                         {"free", &Tally::free},
                                         {"colliding", &Tally::colliding},
                                         {"too_close", &Tally::too_close}};
struct NamedValue {
  const char* name;
  double Tally::*value;
};
inline constexpr NamedValue kMaxima[] = {{"off_u", &Tally::off},
                                         {"widest_gap", &Tally::widest_gap},
                                         {"excess_ulps", &Tally::excess},
                                         {"axes_u", &Tally::axes}};
inline constexpr NamedValue kWorstMerge[] = {
    {"share_of_padding", &Tally::share}, {"rounding_ulps", &Tally::rounding}, {"padding_ulps", &Tally::padding}};

// One regime of one round: the input of a part, and its results.
struct Task {
  const Subject* subject = nullptr;
  std::size_t regime = 0;
  oracle::Random random;
  std::vector<Tally> tallies;         // one per method
  std::vector<std::string> findings;  // what failed, for the first violations

  // Counts a violation. input: the input that failed, in words and numbers.
  void violation(std::size_t method, const std::string& input);
};

// Which columns a part's table has.
enum class Columns {
  kMerges,     // containment, with the padding of one merge
  kBoxes,      // containment
  kPairs,      // misses and false positives
  kFrames,     // the same, and what frames of rows find otherwise than those of brute
  kShapes,     // answers of exact tests, and contacts
  kQueries,    // hits of queries
  kQuick,      // hits of queries, and how many pairs of queries and leaves were judged
  kMotions,    // answers about motions
  kRound,      // answers of frames of balls and capsules, and contacts
  kDepths,     // depths of contacts
  kTriangles,  // answers about triangles
};

struct VerifyPart {
  const char* name;
  const char* judged;  // what is counted
  Columns columns;
  std::vector<std::string> regimes;
  std::vector<std::string> methods;
  void (*run)(Task& task);
};

VerifyPart merges_part();
VerifyPart overlaps_part();
VerifyPart trees_part();
VerifyPart frames_part();
VerifyPart shapes_part();
VerifyPart queries_part();
VerifyPart rays_part();
VerifyPart motions_part();
VerifyPart spheres_part();
VerifyPart points_part();
VerifyPart boxes_part();
VerifyPart capsules_part();
VerifyPart regions_part();
VerifyPart surfaces_part();
VerifyPart round_part();
VerifyPart depths_part();
VerifyPart triangles_part();

// The names of oracle::QueryRegime, in its order.
std::vector<std::string> query_regimes();

// The names of oracle::ConvexRegime, likewise.
std::vector<std::string> convex_regimes();

// All of them, in the order in which they are printed.
const std::vector<VerifyPart>& verify_parts();

// The kernels of every instruction set that runs here.
const std::vector<const kernel::KernelTable*>& all_kernels();

// A method: a name and its policies. Both come from the table of policies, so a new value becomes a method by itself.
struct RefitMethod {
  std::string name;
  Policies policies;
};

// The first refits of the table, each with all extents.
std::vector<RefitMethod> refit_methods(std::uint32_t refit_count);

// Every choice of axes for the overlap test.
std::vector<RefitMethod> sat_methods();

// Every refit with every strategy. Extents vary only if the strategy descends. The values of `sat` vary with every
// refit and strategy on which they have an effect.
std::vector<RefitMethod> frame_methods();

std::vector<std::string> names_of(const std::vector<RefitMethod>& methods);

// A box as text with all digits, so that it can be tested again elsewhere.
std::string to_text(const oracle::OracleBox<float>& box);

// A part and the pose of its link, likewise.
std::string to_text(const oracle::PosedPart& posed);

const char* name_of(ShapeKind kind);

}  // namespace cab::perf
