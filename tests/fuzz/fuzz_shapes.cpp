// Turns bytes into two bodies of convex parts, of extreme sizes and poses, and tests them with the exact kernels. Every
// instruction set writes the same hits and contacts. Parts that have a point in common by a certificate are a hit,
// parts that are far apart are none. A contact is finite, and deep enough to part two parts.
#include "perf/harness/world.h"
#include "perf/judge/oracle/convex_pairs.h"
#include "tests/fuzz/bytes.h"

namespace {

using namespace cab;
using namespace cab::oracle;

// What shapes that are called touching may be apart, in parts of their size and of the distances from their origins.
// Two bits more than docs/embedding.md says, for the rounding of the sum.
constexpr double kWidestGap = 0x1p-38;

// What float leaves of the depth and the normal of a contact, in parts of the size.
constexpr double kContactRounding = 1e-6;

// Below it, a margin masks no instance.
constexpr float kNearRange = 1e17f;

// A body of one link with one leaf.
struct Body {
  std::vector<PosedPart> parts;  // their poses are those of the last instance that was asked for
  std::vector<ConvexPart> list;
  Member member;

  // The parts where an instance has them.
  const std::vector<PosedPart>& at(std::uint32_t instance) {
    for (PosedPart& part : parts) std::copy_n(member.poses.pose(instance, 0), 7, part.pose);
    return parts;
  }
};

// Whole powers of two from 2^-42 to 2^42.
double unit_of(fuzz::Bytes& bytes) { return std::ldexp(1.0, bytes.raw<std::int8_t>() / 3); }

PosedPart part_of(fuzz::Bytes& bytes, double unit) {
  const auto length = [&] { return static_cast<float>(unit * static_cast<double>(bytes.number())); };
  PosedPart out = {};
  out.part.kind = kCaseKinds[bytes.below(static_cast<std::uint32_t>(std::size(kCaseKinds)))];
  for (float& at : out.part.position) at = length();
  for (float& size : out.part.size) {
    size = std::fabs(length());
    if (size == 0) size = static_cast<float>(unit / 64);
    if (bytes.rarely()) size = std::ldexp(size, -static_cast<int>(bytes.below(24)));
  }
  double q[4];
  bytes.turn(q);
  const double by = 1 / std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  for (std::size_t c = 0; c < 4; ++c) out.part.rotation[c] = static_cast<float>(by * q[c]);
  if (out.part.kind == ShapeKind::kConvexHull)
    for (std::uint32_t n = 3 * (4 + bytes.below(30)); n > 0; --n) out.vertices.push_back(length());
  return out;
}

bool is_half_space(const PosedPart& posed) { return posed.part.kind == ShapeKind::kHalfSpace; }

// Half extent of the box of a leaf with a half space, in which nothing is too far away to be found.
constexpr float kPlaneBox = 1e17f;

// No point of a part is farther from its origin; of a half space, no point that boxes are made for.
float reach_of(const PosedPart& posed) {
  float most = 0;
  if (is_half_space(posed)) return most;
  for (std::size_t v = 0; v < posed.vertices.size(); v += 3)
    most = std::max(most,
                    std::fabs(posed.vertices[v]) + std::fabs(posed.vertices[v + 1]) + std::fabs(posed.vertices[v + 2]));
  if (!posed.vertices.empty()) return most;
  return posed.part.size[0] + posed.part.size[1] + posed.part.size[2];
}

void fill(fuzz::Bytes& bytes, std::uint32_t instances, Body& out) {
  const double unit = unit_of(bytes), far = bytes.rarely() ? unit_of(bytes) : unit;
  float half[3] = {};
  for (std::uint32_t n = bytes.rarely() ? 3 : 1; n > 0; --n) out.parts.push_back(part_of(bytes, unit));
  for (PosedPart& posed : out.parts) {
    posed.part.vertices = posed.vertices;
    for (std::size_t c = 0; c < 3; ++c)
      half[c] = std::max({half[c], 1.001f * (std::fabs(posed.part.position[c]) + reach_of(posed)),
                          is_half_space(posed) ? kPlaneBox : 0.0f});
    out.list.push_back(posed.part);
  }
  out.member.rig.parents = {-1};
  out.member.rig.leaves = {{0, {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {half[0], half[1], half[2]}}, out.list}};
  Poses& poses = out.member.poses;
  poses.link_count = 1;
  poses.instance_count = instances;
  poses.data.resize(std::size_t{instances} * 7);
  for (std::uint32_t i = 0; i < instances; ++i) {
    double q[4], at[3];
    bytes.turn(q);
    for (double& c : at) c = far * static_cast<double>(bytes.number());
    write_pose(poses.format, q, {{at[0], at[1], at[2]}}, poses.pose(i, 0));
    for (int c = 0; c < 3; ++c)
      poses.origins.push_back(bytes.rarely() ? far * static_cast<double>(bytes.number()) : 0.0);
  }
}

struct Found {
  std::vector<Hit> hits;
  std::vector<Contact> contacts;
  std::vector<std::uint8_t> flags[2];
};

Found run(Isa isa, const World& world, float margin) {
  const EnginePtr engine = make_engine_for(world, {isa});
  Found out;
  BatchInput inputs[2];
  for (std::size_t m = 0; m < 2; ++m) {
    const Poses& poses = world.members[m].poses;
    inputs[m] = poses.input({static_cast<std::uint32_t>(m + 1)});
    out.flags[m].assign(poses.instance_count, 0xee);
    inputs[m].flags = out.flags[m];
    out.hits.resize(std::max<std::size_t>(out.hits.size(), poses.instance_count));
  }
  out.contacts.resize(out.hits.size());
  FrameJob job;
  job.inputs = {inputs, 2};
  job.rules = world.rules;
  job.policies.exact = Exact::kConvex;
  job.margin = margin;
  job.hits = out.hits;
  job.contacts = out.contacts;
  require(run_frame(*engine, job));
  out.hits.resize(job.hit_count);
  out.contacts.resize(job.hit_count);
  return out;
}

bool same_bits(const Found& a, const Found& b) {
  return same_hits(a.hits, b.hits) && a.flags[0] == b.flags[0] && a.flags[1] == b.flags[1] &&
         (a.contacts.empty() ||
          std::memcmp(a.contacts.data(), b.contacts.data(), a.contacts.size() * sizeof(Contact)) == 0);
}

// How far a body's box reaches from its link, or its link is from its instance, whichever is more.
float extent_of(const Body& body) {
  float most = 0;
  for (const float half : body.member.rig.leaves[0].box.half) most += half;
  for (std::size_t f = 0; f < body.member.poses.data.size(); f += 7)
    for (std::size_t c = 4; c < 7; ++c) most = std::max(most, std::fabs(body.member.poses.data[f + c]));
  return most;
}

// Two half spaces have a contact of zeros.
bool is_finite(const Contact& contact, bool may_be_zero) {
  bool out = std::isfinite(contact.depth);
  for (std::size_t c = 0; c < 3; ++c)
    out = out && std::isfinite(contact.point_a[c]) && std::isfinite(contact.point_b[c]);
  const float length = std::hypot(contact.normal[0], contact.normal[1], contact.normal[2]);
  return out && ((may_be_zero && length == 0) || std::fabs(length - 1) < 1e-5f);
}

// How far a part is from the origins of its link and its instance.
double away_of(const PosedPart& posed) {
  double out = 0;
  for (std::size_t c = 0; c < 3; ++c)
    out += static_cast<double>(std::fabs(posed.pose[4 + c]) + std::fabs(posed.part.position[c]));
  return out;
}

// Judges the pair of a's only instance and one of b's.
void judge_pair(Body& a, Body& b, std::uint32_t instance, const Contact* contact) {
  bool touching = false, far_apart = true;
  ConvexCase one;
  for (std::size_t c = 0; c < 3; ++c)
    one.shift[c] = b.member.poses.origins[3 * instance + c] - a.member.poses.origins[c];
  for (const PosedPart& part_a : a.at(0)) {
    for (const PosedPart& part_b : b.at(instance)) {
      if (is_half_space(part_a) && is_half_space(part_b)) {
        far_apart = false;
        continue;
      }
      one.a = part_a;
      one.b = part_b;
      const JudgedShapes shapes(one);
      const Certificate found = certify(shapes.a, shapes.b, Effort::kDecide);
      touching = touching || found.proof == Proof::kTouching;
      const double size = static_cast<double>(norm_1(shapes.b.pose.at - shapes.a.pose.at)) +
                          static_cast<double>(reach_of(part_a)) + static_cast<double>(reach_of(part_b));
      far_apart = far_apart && found.proof == Proof::kApart &&
                  found.gap > kWidestGap * (size + away_of(part_a) + away_of(part_b));
      if (!contact || a.parts.size() * b.parts.size() > 1) continue;
      ConvexCase parted = one;
      for (std::size_t c = 0; c < 3; ++c)
        parted.shift[c] +=
            static_cast<double>(contact->normal[c]) * (static_cast<double>(contact->depth) + kContactRounding * size);
      const JudgedShapes moved(parted);
      FUZZ_CHECK(certify(moved.a, moved.b, Effort::kDecide).proof != Proof::kTouching);
    }
  }
  FUZZ_CHECK(!touching || contact);
  FUZZ_CHECK(!far_apart || !contact);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Bytes bytes(data, size);
  constexpr std::uint32_t kCounts[] = {1, 2, 17};
  const std::uint32_t count = kCounts[bytes.below(3)];
  const float margin = std::fabs(bytes.number());
  Body a, b;
  fill(bytes, 1, a);
  fill(bytes, count, b);
  const World world = {{a.member, b.member}, {{{1}, {2}, Pairing::kBetween}}, 0};
  Found found, wider;
  try {
    found = run(Isa::kScalar, world, 0);
    wider = run(Isa::kScalar, world, margin);
  } catch (const std::runtime_error&) { return 0; }  // refused by a status
  FUZZ_CHECK(same_bits(found, run(Isa::kAuto, world, 0)) && same_bits(wider, run(Isa::kAuto, world, margin)));
  // A margin that takes boxes out of range masks their instances.
  const auto is_masked_by_margin = [&](std::size_t body, std::uint32_t instance) {
    return wider.flags[body][instance] != kInstanceOk && found.flags[body][instance] == kInstanceOk;
  };
  FUZZ_CHECK(!is_masked_by_margin(0, 0) || margin + extent_of(a) >= kNearRange);
  for (std::uint32_t i = 0; i < count; ++i)
    FUZZ_CHECK(!is_masked_by_margin(1, i) || margin + extent_of(b) >= kNearRange);
  std::vector<Hit> also_wider = found.hits;
  std::erase_if(also_wider, [&](const Hit& hit) {
    return is_masked_by_margin(0, hit.instance_a) || is_masked_by_margin(1, hit.instance_b);
  });
  FUZZ_CHECK(missing_from(also_wider, wider.hits) == 0);
  const auto has_half_space = [](const Body& body) {
    return std::any_of(body.parts.begin(), body.parts.end(), is_half_space);
  };
  const bool may_be_zero = has_half_space(a) && has_half_space(b);
  for (const Contact& contact : found.contacts) FUZZ_CHECK(is_finite(contact, may_be_zero) && contact.depth >= 0);
  for (const Contact& contact : wider.contacts) FUZZ_CHECK(is_finite(contact, may_be_zero));

  std::vector<const Contact*> contact_of(count);
  for (std::size_t hit = 0; hit < found.hits.size(); ++hit)
    contact_of[found.hits[hit].instance_b] = &found.contacts[hit];
  for (std::uint32_t i = 0; i < count; ++i) {
    const bool masked = found.flags[0][0] != kInstanceOk || found.flags[1][i] != kInstanceOk;
    FUZZ_CHECK(!masked || !contact_of[i]);
    if (!masked) judge_pair(a, b, i, contact_of[i]);
  }
  return 0;
}
