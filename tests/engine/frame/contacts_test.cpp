// Contacts of links, hits that are dropped by depth, distances, and compute_contacts.
#include "perf/harness/random_world.h"
#include "tests/rounds.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <limits>

namespace {

using namespace cab;
using namespace cab::oracle;
using tests::rounds;

constexpr Policies kConvex = {Refit::kCab, Strategy::kAuto, Exact::kConvex};
constexpr Box kRoom = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {9, 9, 9}};

ConvexPart ball(float radius, float x, float y, float z) {
  ConvexPart part;
  part.kind = ShapeKind::kEllipsoid;
  for (float& size : part.size) size = radius;
  part.position[0] = x, part.position[1] = y, part.position[2] = z;
  return part;
}

// One link with a leaf for each part.
Rig rig_of(const std::vector<ConvexPart>& parts) {
  Rig rig;
  rig.parents = {-1};
  for (const ConvexPart& part : parts) rig.leaves.push_back({0, kRoom, {&part, 1}});
  return rig;
}

// Instances of a rig without rotation, at their origins.
Member member_at(const Rig& rig, const std::vector<oracle::Vec3<double>>& origins) {
  Member member;
  member.rig = rig;
  member.poses.link_count = static_cast<std::uint32_t>(rig.parents.size());
  member.poses.instance_count = static_cast<std::uint32_t>(origins.size());
  for (const oracle::Vec3<double>& at : origins) {
    for (std::size_t l = 0; l < rig.parents.size(); ++l)
      member.poses.data.insert(member.poses.data.end(), {0, 0, 0, 1, 0, 0, 0});
    member.poses.origins.insert(member.poses.origins.end(), {at[0], at[1], at[2]});
  }
  return member;
}

bool same_contacts(const std::vector<Contact>& x, const std::vector<Contact>& y) {
  return x.size() == y.size() && (x.empty() || std::memcmp(x.data(), y.data(), x.size() * sizeof(Contact)) == 0);
}

Outcome outcome_of(const World& world, const Policies& policies, Report report = Report::kHits) {
  return run_on(*make_engine_for(world), world, policies, run_frame, report);
}

// A world of random rigs, every second leaf an ellipsoid in its box, that asks for contacts.
struct RandomShapes {
  World world;
  std::vector<std::vector<ConvexPart>> parts;

  explicit RandomShapes(Random& random) {
    world.contacts = true;
    add_characters(random, world, 8);
    add_frames(random, world, 8);
    for (Member& member : world.members) {
      parts.emplace_back();
      for (const Leaf& leaf : member.rig.leaves) {
        const float least = std::min({leaf.box.half[0], leaf.box.half[1], leaf.box.half[2]});
        parts.back().push_back(ball(0.999f * least, leaf.box.center[0], leaf.box.center[1], leaf.box.center[2]));
      }
      for (std::size_t l = 0; l < member.rig.leaves.size(); l += 2)
        if (parts.back()[l].size[0] > 0) member.rig.leaves[l].parts = {&parts.back()[l], 1};
    }
  }
};

}  // namespace

TEST_CASE("the contact of two links is the deepest of all their leaves, the hit names the lowest that touch") {
  const std::vector<ConvexPart> balls = {ball(1, 0, 0, 0), ball(1, 3, 0, 0)};
  for (const Exact exact : {Exact::kConvex, Exact::kFcl})
    for (const bool swapped : {false, true}) {
      if (exact == Exact::kFcl && !build_info().fcl) {
        MESSAGE("skipped: this build lacks FCL");
        continue;
      }
      CAPTURE(static_cast<int>(exact));
      CAPTURE(swapped);
      World world;
      world.contacts = true;
      world.members = {member_at(rig_of(balls), {{{1e6, 0, 0}}}), member_at(rig_of(balls), {{{1e6 + 1.75, 0, 0}}})};
      if (swapped) std::swap(world.members[0], world.members[1]);
      world.rules = {{{1}, {2}, Pairing::kBetween}};
      const Outcome outcome = outcome_of(world, {Refit::kCab, Strategy::kTree, exact});
      REQUIRE(outcome.hits.size() == 1);
      CHECK(outcome.hits[0].leaf_a == 0);
      CHECK(outcome.hits[0].leaf_b == 0);
      const Contact& contact = outcome.contacts[0];
      // Leaf 1 of the left link is 1.25 to the right of leaf 0 of the other, 0.75 deep; other pairs overlap by less.
      const float on_a = contact.point_a[0], on_b = contact.point_b[0];  // relative to the origin of a
      CHECK(contact.leaf_a == (swapped ? 0 : 1));
      CHECK(contact.leaf_b == (swapped ? 1 : 0));
      CHECK(std::fabs(contact.depth - 0.75f) < 1e-5f);
      CHECK(std::fabs(contact.normal[0] - (swapped ? 1 : -1)) < 1e-4f);
      CHECK(std::fabs(on_a - (swapped ? 1.0f : 2.0f)) < 1e-3f);
      CHECK(std::fabs(on_b - (swapped ? 0.25f : 2.75f)) < 1e-3f);
    }
}

TEST_CASE("of equally deep contacts the one of the lowest leaves is taken") {
  const std::vector<ConvexPart> balls(3, ball(1, 0, 0, 0));
  World world;
  world.contacts = true;
  world.members = {member_at(rig_of(balls), {{{0, 0, 0}}}), member_at(rig_of(balls), {{{1.5, 0, 0}}})};
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  const Contact contact = outcome_of(world, kConvex).contacts.at(0);
  CHECK(contact.leaf_a == 0);
  CHECK(contact.leaf_b == 0);
}

TEST_CASE("contacts have the same bits for every strategy, instruction set and thread count, and by compute_contacts") {
  std::size_t contacts = 0;
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    RandomShapes made(random);
    World& world = made.world;
    if (seed % 2 == 0) world.margin = 0.05f;
    const Outcome expected = outcome_of(world, kConvex);
    contacts += expected.contacts.size();
    for (const Isa isa : available_isas())
      for (const std::uint32_t threads : {1u, 2u})
        for (const Strategy strategy : {Strategy::kTree, Strategy::kLinks}) {
          EngineDesc desc;
          desc.isa = isa;
          desc.thread_count = threads;
          const Outcome other = run_world(world, {Refit::kCab, strategy, Exact::kConvex}, desc);
          CHECK(same_contacts(other.contacts, expected.contacts));
        }
    std::vector<BatchInput> inputs;
    for (std::size_t m = 0; m < world.members.size(); ++m)
      inputs.push_back(world.members[m].poses.input({static_cast<std::uint32_t>(m + 1)}));
    const EnginePtr engine = make_engine_for(world);
    std::vector<Contact> measured(expected.hits.size());
    REQUIRE(compute_contacts(*engine, inputs, expected.hits, measured) == Status::kOk);
    std::size_t different = 0;
    for (std::size_t i = 0; i < measured.size(); ++i) {
      Contact frame = expected.contacts[i];
      // Without a margin, a frame says 0 of shapes that could not be shown to be apart.
      if (world.margin == 0 && frame.depth == 0) frame.depth = measured[i].depth;
      different += std::memcmp(&frame, &measured[i], sizeof(Contact)) != 0;
    }
    CHECK(different == 0);
  }
  CHECK(contacts > (rounds(6) < 6 ? 0 : 20 * rounds(6)));
}

TEST_CASE("hits that are less deep than min_depth are dropped, no other, and in_contact follows those left") {
  std::size_t dropped = 0, left = 0;
  for (const Exact exact : {Exact::kConvex, Exact::kFcl})
    for (std::uint64_t seed = 1; seed <= 3 + rounds(4); ++seed) {
      if (exact == Exact::kFcl && !build_info().fcl) {
        MESSAGE("skipped: this build lacks FCL");
        continue;
      }
      CAPTURE(seed);
      Random random(seed);
      RandomShapes made(random);
      World& world = made.world;
      const Policies policies = {Refit::kCab, Strategy::kAuto, exact};
      const Outcome all = outcome_of(world, policies);
      if (all.contacts.empty()) continue;
      // A depth that occurs, so that "at least" is tested, too.
      world.min_depth = all.contacts[all.contacts.size() / 2].depth;
      if (world.min_depth == 0) continue;
      for (const bool contacts : {true, false}) {
        world.contacts = contacts;
        const Outcome some = outcome_of(world, policies);
        std::vector<Hit> hits;
        std::vector<Contact> kept;
        for (std::size_t i = 0; i < all.hits.size(); ++i) {
          if (all.contacts[i].depth < world.min_depth) continue;
          hits.push_back(all.hits[i]);
          if (contacts) kept.push_back(all.contacts[i]);
        }
        CHECK(same_hits(some.hits, hits));
        CHECK(same_contacts(some.contacts, kept));
        CHECK(some.in_contact == in_contact_by(world, hits));
        dropped += all.hits.size() - hits.size();
        left += hits.size();
      }
    }
  CHECK(dropped > 0);
  CHECK(left > 0);
}

TEST_CASE("distances: of every two instances within the margin the nearest links") {
  std::size_t left = 0, dropped = 0;
  for (std::uint64_t seed = 1; seed <= rounds(6); ++seed) {
    CAPTURE(seed);
    Random random(seed);
    RandomShapes made(random);
    World& world = made.world;
    world.margin = 0.1f;
    const Outcome all = outcome_of(world, kConvex), nearest = outcome_of(world, kConvex, Report::kDistances);
    std::vector<Hit> hits;
    std::vector<Contact> contacts;
    for (std::size_t i = 0; i < all.hits.size(); ++i) {
      const auto instances = [](const Hit& hit) {
        return std::tuple(hit.batch_a.value, hit.instance_a, hit.batch_b.value, hit.instance_b);
      };
      if (hits.empty() || instances(hits.back()) != instances(all.hits[i])) {
        hits.push_back(all.hits[i]);
        contacts.push_back(all.contacts[i]);
      } else if (all.contacts[i].depth > contacts.back().depth) {
        hits.back() = all.hits[i];
        contacts.back() = all.contacts[i];
      }
    }
    CHECK(same_hits(nearest.hits, hits));
    CHECK(same_contacts(nearest.contacts, contacts));
    CHECK(nearest.in_contact == all.in_contact);
    left += hits.size();
    dropped += all.hits.size() - hits.size();
  }
  CHECK(left > 0);
  CHECK(dropped > 0);
}

TEST_CASE("distances: of links that are equally near the first is reported") {
  const std::vector<ConvexPart> one = {ball(1, 0, 0, 0)};
  Rig two = rig_of(one);
  two.parents = {-1, 0};
  two.leaves.push_back({1, kRoom, two.leaves[0].parts});  // the same ball on another link
  World world;
  world.contacts = true;
  world.margin = 1;
  world.members = {member_at(two, {{{0, 0, 0}}}), member_at(two, {{{2.5, 0, 0}}})};
  world.rules = {{{1}, {2}, Pairing::kBetween}};
  CHECK(outcome_of(world, kConvex).hits.size() == 4);
  const Outcome nearest = outcome_of(world, kConvex, Report::kDistances);
  REQUIRE(nearest.hits.size() == 1);
  CHECK(nearest.hits[0].link_a == 0);
  CHECK(nearest.hits[0].link_b == 0);
}

TEST_CASE("compute_contacts measures any two links at any distance, and says which have no valid pose") {
  const std::vector<ConvexPart> one = {ball(1, 0, 0, 0)};
  World world;
  world.members = {member_at(rig_of(one), {{{0, 0, 0}}, {{5, 0, 0}}, {{0, 3e7, 4e7}}, {{0, 0, 0}}})};
  world.members[0].poses.data[3 * 7 + 4] = std::numeric_limits<float>::quiet_NaN();
  const EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  const Hit pairs[] = {{{1}, 0, {1}, 1, 0, 0, 77, 78}, {{1}, 2, {1}, 0, 0, 0, 0, 0}, {{1}, 3, {1}, 0, 0, 0, 0, 0}};
  Contact contacts[3];
  REQUIRE(compute_contacts(*engine, {&input, 1}, {pairs, 3}, {contacts, 3}) == Status::kOk);
  CHECK(std::fabs(contacts[0].depth + 3) < 1e-5f);
  CHECK(std::fabs(contacts[0].normal[0] - 1) < 1e-5f);
  CHECK(std::fabs(contacts[0].point_a[0] - 1) < 1e-4f);
  CHECK(std::fabs(contacts[0].point_b[0] - 4) < 1e-4f);
  CHECK(contacts[0].leaf_a == 0);
  CHECK(std::fabs(contacts[1].depth + 5e7f) < 10);
  CHECK(std::fabs(contacts[1].normal[1] + 0.6f) < 1e-4f);
  CHECK(contacts[2].depth == -std::numeric_limits<float>::infinity());
  CHECK(contacts[2].normal[0] == 0);
}

TEST_CASE("compute_contacts measures links farther apart than frames test, up to float's range") {
  const std::vector<ConvexPart> two = {ball(1, 0, 0, 0), ball(1, 2, 0, 0)};
  for (std::size_t parts = 1; parts <= 2; ++parts) {
    Rig rig;
    rig.parents = {-1};
    rig.leaves = {{0, kRoom, {two.data(), parts}}};
    World world;
    world.members = {member_at(rig, {{{0, 0, 0}}, {{0, 0, 0}}})};
    const EnginePtr engine = make_engine_for(world);
    for (const double far : {1e17, 1e19, 1e38, 1e39, 1e100, 1e200, 1.7e308}) {
      CAPTURE(parts);
      CAPTURE(far);
      world.members[0].poses.origins = {-far, -far, 0, far, far, 0};
      const BatchInput input = world.members[0].poses.input({1});
      const Hit pair = {{1}, 0, {1}, 1, 0, 0, 0, 0};
      Contact contact;
      std::memset(static_cast<void*>(&contact), 0x5a, sizeof(contact));
      REQUIRE(compute_contacts(*engine, {&input, 1}, {&pair, 1}, {&contact, 1}) == Status::kOk);
      const double most = std::numeric_limits<float>::max(), gap = std::min(2 * std::sqrt(2.0) * far, most);
      CHECK(static_cast<double>(contact.depth) >= -gap * (1 + 1e-6));
      CHECK(static_cast<double>(contact.depth) <= -gap * (1 - 1e-6));
      for (int c = 0; c < 3; ++c)
        CHECK(std::fabs(static_cast<double>(contact.normal[c]) - (c < 2 ? std::sqrt(0.5) : 0)) < 1e-6);
      CHECK(std::fabs(contact.point_a[0]) <= 3);
      CHECK(std::fabs(static_cast<double>(contact.point_b[1]) / std::min(2 * far, most) - 1) < 1e-6);
      CHECK(contact.leaf_a == 0);
      CHECK(contact.leaf_b == 0);
    }
  }
}

TEST_CASE("compute_contacts measures half spaces beyond float's range on both sides") {
  ConvexPart parts[] = {ball(1, 0, 0, 0), ball(1, 0, 0, 0)};
  parts[1].kind = ShapeKind::kHalfSpace;
  World world;
  for (const ConvexPart& part : parts) {
    Rig rig;
    rig.parents = {-1};
    rig.leaves = {{0, kRoom, {&part, 1}}};
    world.members.push_back(member_at(rig, {{{0, 0, 0}}}));
  }
  const EnginePtr engine = make_engine_for(world);
  for (const double height : {1e20, -1e20, 1e39, -1e39, 1e200, -1e200}) {
    CAPTURE(height);
    world.members[0].poses.origins = {0, 0, height};
    const BatchInput inputs[] = {world.members[0].poses.input({1}), world.members[1].poses.input({2})};
    const Hit pair = {{1}, 0, {2}, 0, 0, 0, 0, 0};
    Contact contact;
    REQUIRE(compute_contacts(*engine, {inputs, 2}, {&pair, 1}, {&contact, 1}) == Status::kOk);
    const double most = std::numeric_limits<float>::max(), depth = std::min(std::max(-height, -most), most);
    CHECK(std::fabs(static_cast<double>(contact.depth) / depth - 1) < 1e-6);
    CHECK(contact.normal[2] == -1);
  }
}

TEST_CASE("compute_contacts refuses pairs that do not exist, and writes nothing") {
  const std::vector<ConvexPart> one = {ball(1, 0, 0, 0)};
  Rig rig = rig_of(one);
  rig.parents.push_back(0);  // a link without leaves
  World world;
  world.members = {member_at(rig, {{{0, 0, 0}}, {{1, 0, 0}}}), member_at(rig, {{{0, 0, 0}}})};
  const EnginePtr engine = make_engine_for(world);
  const BatchInput input = world.members[0].poses.input({1});
  Contact contact, before;
  std::memset(static_cast<void*>(&contact), 0xcd, sizeof(contact));
  before = contact;
  const auto status_of = [&](const Hit& pair, std::size_t room = 1) {
    const Status status = compute_contacts(*engine, {&input, 1}, {&pair, 1}, {&contact, room});
    CHECK(std::memcmp(&contact, &before, sizeof(contact)) == 0);
    return status;
  };
  CHECK(status_of({{1}, 0, {1}, 0, 0, 0, 0, 0}) == Status::kBadPairs);  // a link with itself
  CHECK(status_of({{1}, 0, {1}, 2, 0, 0, 0, 0}) == Status::kBadPairs);  // no such instance
  CHECK(status_of({{1}, 0, {1}, 1, 0, 1, 0, 0}) == Status::kBadPairs);  // no leaf
  CHECK(status_of({{1}, 0, {1}, 1, 0, 9, 0, 0}) == Status::kBadPairs);  // no such link
  CHECK(status_of({{1}, 0, {2}, 0, 0, 0, 0, 0}) == Status::kBadPairs);  // no input
  CHECK(status_of({{0}, 0, {1}, 0, 0, 0, 0, 0}) == Status::kBadPairs);
  const Hit good = {{1}, 0, {1}, 1, 0, 0, 0, 0};
  CHECK(status_of(good, 0) == Status::kBadOutput);
  CHECK(compute_contacts(*engine, {&input, 1}, {nullptr, 1}, {&contact, 1}) == Status::kBadPairs);
  CHECK(compute_contacts(*engine, {&input, 1}, {}, {}) == Status::kOk);
  CHECK(compute_contacts(*engine, {&input, 1}, {&good, 1}, {&contact, 1}) == Status::kOk);
  CHECK(contact.depth > 0);
}
