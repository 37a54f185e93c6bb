// The public fit_box: its result is accepted as a leaf, in any floating-point mode of the caller.
#include <cab/cab.h>

#include <doctest/doctest.h>

#include <cfenv>
#include <cstring>
#include <initializer_list>

using namespace cab;

namespace {

constexpr float kVertices[] = {0.1f, 0.2f, 0.3f, 2.3f, 0.7f, -0.4f, -0.5f, 1.9f, 0.6f, 0.2f, -0.3f, 1.1f};

}  // namespace

TEST_CASE("the box about a mesh's vertices is accepted as a leaf's, and holds them as its shape") {
  Leaf leaf;
  REQUIRE(fit_box({kVertices, 12}, &leaf.box) == Status::kOk);
  ConvexPart part;
  part.kind = ShapeKind::kConvexHull;
  part.vertices = {kVertices, 12};
  leaf.parts = {&part, 1};
  const std::int32_t parent = -1;
  Engine* engine = nullptr;
  REQUIRE(create_engine({}, &engine) == Status::kOk);
  ArticulationId id;
  CHECK(add_articulation(*engine, {{&parent, 1}, {}, {&leaf, 1}, {}}, &id) == Status::kOk);
  destroy_engine(engine);
}

TEST_CASE("a caller's rounding mode changes no bit of a fitted box and still stands afterwards") {
  Box expected, box;
  REQUIRE(fit_box({kVertices, 12}, &expected) == Status::kOk);
  for (const int mode : {FE_UPWARD, FE_DOWNWARD, FE_TOWARDZERO}) {
    REQUIRE(std::fesetround(mode) == 0);
    const Status status = fit_box({kVertices, 12}, &box);
    const int after = std::fegetround();
    std::fesetround(FE_TONEAREST);
    CHECK(status == Status::kOk);
    CHECK(after == mode);
    CHECK(std::memcmp(&box, &expected, sizeof box) == 0);
  }
}

TEST_CASE("fit_box refuses what is no mesh") {
  Box box;
  CHECK(fit_box({}, &box) == Status::kBadVertices);
  CHECK(fit_box({kVertices, 11}, &box) == Status::kBadVertices);
  CHECK(fit_box({kVertices, 12}, nullptr) == Status::kBadOutput);
}
