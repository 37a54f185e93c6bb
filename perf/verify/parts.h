// What `cab verify` verifies: parts, each of which judges the library exactly by regimes (hard inputs) and methods
// (what a policy chooses). A round runs every regime of every part once; its inputs follow from the seed and its number
// alone.
#pragma once

#include <cab/cab.h>

#include <cstdint>
#include <string>
#include <vector>

#include "kernels/find_kernels.h"
#include "perf/oracle/oracle_box.h"
#include "perf/oracle/random.h"

namespace cab::perf {

// What is verified: the library, or in a test something that is broken on purpose.
struct Subject {
  const kernel::KernelTable* kernels = nullptr;  // its isa is that of the engines too
  decltype(&cab::compute_boxes) compute_boxes = cab::compute_boxes;
  decltype(&cab::run_frame) run_frame = cab::run_frame;
};

// One row's counts. Sums and maxima only, so that they depend on which rounds ran and on nothing else.
struct Tally {
  std::uint64_t judged = 0;           // what the part counts
  std::uint64_t violations = 0;       // boxes that do not hold what they must; touching pairs that were not reported
  std::uint64_t touching = 0;         // pairs that the judge calls touching
  std::uint64_t false_positives = 0;  // pairs reported that the judge calls apart
  std::uint64_t differing = 0;        // pairs that another strategy reports otherwise
  double excess = -1e300;  // largest by which a corner leaves its box, in ulps of size u (S + M); negative: inside
  double axes = 0;         // largest |R^T R - I| of a box that was made, in u
  // Where rounding took most of the padding: the share, and both in ulps of size.
  double share = -1e300, rounding = 0, padding = 0;

  void add(const Tally& other);
};

// One regime of one round: what a part is given, and where it writes.
struct Task {
  const Subject* subject = nullptr;
  std::size_t regime = 0;
  oracle::Random random;
  std::vector<Tally> tallies;         // a method each
  std::vector<std::string> findings;  // of the first violations, what failed

  // Counts a violation. input: what failed, in words and numbers.
  void violation(std::size_t method, const std::string& input);
};

// Which columns a part's table has.
enum class Columns {
  kMerges,  // containment, with the padding of one merge
  kBoxes,   // containment
  kPairs,   // misses and false positives
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

// All of them, in the order in which they are printed.
const std::vector<VerifyPart>& verify_parts();

// A method is a name and the policies behind it, both from the table of policies: a new value joins by itself.
struct RefitMethod {
  std::string name;
  Policies policies;
};

// The first refits of the table, each with all extents.
std::vector<RefitMethod> refit_methods(std::uint32_t refit_count);

// Every choice of axes for the overlap test.
std::vector<RefitMethod> sat_methods();

// Every refit with every strategy; extents only where a strategy descends, and no refit where boxes are not used. Fewer
// axes are tested with every refit and strategy that they matter to.
std::vector<RefitMethod> frame_methods();

std::vector<std::string> names_of(const std::vector<RefitMethod>& methods);

// A box with all digits, to be replayed elsewhere.
std::string to_text(const oracle::OracleBox<float>& box);

}  // namespace cab::perf
