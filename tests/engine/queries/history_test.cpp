// Queries about the past: at moments that a history has, and between two of them. What is answered there is what
// run_queries answers for the same poses as inputs, bit for bit; and right by the judge.
#include "perf/harness/random_world.h"
#include "perf/judge/oracle/query_judge.h"
#include "perf/judge/oracle/random_queries.h"
#include "tests/aligned_memory.h"
#include "tests/engine/thread_pool.h"
#include "tests/seeds.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <limits>

namespace cab::tests {
namespace {

using namespace cab::oracle;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr double kNoTime = std::numeric_limits<double>::quiet_NaN();
constexpr Exact kBoth[] = {Exact::kNone, Exact::kConvex};
constexpr Box kUnitBox = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {1, 1, 1}};

// --------------------------------------------------------------------------------------------------------- moments

// One moment of a batch. Of the instances that are listed those take part that are not masked.
struct Moment {
  double time = 0;
  Poses poses;
  std::vector<std::uint32_t> layers;
  std::vector<std::uint32_t> listed;  // all that are given
  std::vector<bool> present;

  BatchInput input(BatchId batch) const {
    BatchInput out = poses.input(batch);
    out.layers = layers;
    if (listed.empty())
      out.count = 0;
    else
      out.instances = listed;
    return out;
  }
};

// The quaternion between two, as docs/rewind.md has it.
void blend(const float* q, const float* r, float part, float* out) {
  const float length_q = std::sqrt((q[0] * q[0] + q[1] * q[1]) + (q[2] * q[2] + q[3] * q[3]));
  const float length_r = std::sqrt((r[0] * r[0] + r[1] * r[1]) + (r[2] * r[2] + r[3] * r[3]));
  const float cosine = (q[0] * r[0] + q[1] * r[1]) + (q[2] * r[2] + q[3] * r[3]);
  const float of_q = (1 - part) / length_q, toward = part / length_r, of_r = cosine < 0 ? 0 - toward : toward;
  for (int c = 0; c < 4; ++c) out[c] = of_q * q[c] + of_r * r[c];
}

// The poses between two moments, of quaternions.
Moment between(const Moment& from, const Moment& to, double time) {
  constexpr float kIdentity[4] = {0, 0, 0, 1};
  Moment out = from;
  out.time = time;
  out.listed.clear();
  const double part = (0.5 * time - 0.5 * from.time) / (0.5 * to.time - 0.5 * from.time);
  const auto by = static_cast<float>(part);
  const std::uint32_t count = from.poses.instance_count;
  const bool oriented = !from.poses.orientations.empty() || !to.poses.orientations.empty();
  const bool scaled = !from.poses.scales.empty() || !to.poses.scales.empty();
  const bool placed = !from.poses.origins.empty() || !to.poses.origins.empty();
  out.poses.orientations.assign(oriented ? 4 * std::size_t{count} : 0, 0.0f);
  out.poses.scales.assign(scaled ? count : 0, 1.0f);
  out.poses.origins.assign(placed ? 3 * std::size_t{count} : 0, 0.0);
  for (std::uint32_t i = 0; i < count; ++i) {
    out.present[i] = from.present[i] && to.present[i];
    if (!out.present[i]) continue;
    out.listed.push_back(i);
    for (std::uint32_t link = 0; link < from.poses.link_count; ++link) {
      const float *const a = from.poses.pose(i, link), *const b = to.poses.pose(i, link);
      float* const mid = out.poses.pose(i, link);
      blend(a, b, by, mid);
      for (int c = 4; c < 7; ++c) mid[c] = (1 - by) * a[c] + by * b[c];
    }
    const auto orientation = [&](const Moment& at) {
      return at.poses.orientations.empty() ? kIdentity : at.poses.orientations.data() + 4 * std::size_t{i};
    };
    const auto scale = [&](const Moment& at) { return at.poses.scales.empty() ? 1.0f : at.poses.scales[i]; };
    if (oriented) blend(orientation(from), orientation(to), by, out.poses.orientations.data() + 4 * std::size_t{i});
    if (scaled) out.poses.scales[i] = (1 - by) * scale(from) + by * scale(to);
    for (std::size_t c = 0; c < 3 && placed; ++c) {
      const auto origin = [&](const Moment& at) { return at.poses.origins.empty() ? 0 : at.poses.origins[3 * i + c]; };
      out.poses.origins[3 * i + c] = origin(from) + part * (origin(to) - origin(from));
    }
  }
  return out;
}

// Where a batch is at a time, by the last `kept` of its moments.
Moment at_time(const std::vector<Moment>& all, std::size_t kept, double time) {
  const std::vector<Moment> last(all.end() - static_cast<std::ptrdiff_t>(std::min(kept, all.size())), all.end());
  const auto as_given = [](Moment one) {
    one.listed.clear();
    for (std::uint32_t i = 0; i < one.present.size(); ++i)
      if (one.present[i]) one.listed.push_back(i);
    return one;
  };
  if (time <= last.front().time) return as_given(last.front());
  for (std::size_t i = 1; i < last.size(); ++i) {
    if (time == last[i].time) return as_given(last[i]);
    if (time < last[i].time) return between(last[i - 1], last[i], time);
  }
  return as_given(last.back());
}

struct Member {
  Rig rig;
  std::uint32_t instances;
  std::vector<Moment> moments;
};

// A world with a past. Batch m + 1 is that of member m, and the last one that of static boxes.
struct Past {
  std::vector<Member> members;
  std::uint32_t kept = 0;
  std::vector<StaticBody> bodies;
  KeptParts parts;

  std::vector<double> times() const {
    std::vector<double> out;
    for (const Moment& moment : members[0].moments) out.push_back(moment.time);
    return out;
  }

  // The engine, and the histories of all members that a test asks for.
  EnginePtr engine(std::vector<HistoryId>* histories, const EngineDesc& desc = {}, std::uint32_t queries = 64) const {
    EnginePtr out = make_engine(desc);
    for (const Member& member : members) add_instances(*out, add_rig(*out, member.rig), member.instances);
    if (!bodies.empty()) {
      StaticDesc level;
      level.bodies = bodies;
      BatchId id;
      require(add_static_batch(*out, level, &id));
    }
    ReserveDesc room;
    room.queries = queries;
    require(reserve(*out, room));
    for (std::uint32_t m = 0; m < members.size() && histories; ++m) {
      HistoryDesc ring;
      ring.batch = {m + 1};
      ring.ticks = kept;
      require(add_history(*out, ring, &histories->emplace_back()));
      for (const Moment& moment : members[m].moments)
        require(record_tick(*out, histories->back(), moment.input({m + 1}), moment.time));
    }
    return out;
  }

  BatchInput body_input() const {
    BatchInput out;
    out.batch = {static_cast<std::uint32_t>(members.size() + 1)};
    return out;
  }

  QueryScene scene(double time) const {
    QueryScene out;
    for (std::uint32_t m = 0; m < members.size(); ++m) {
      const Moment now = at_time(members[m].moments, kept, time);
      for (const std::uint32_t i : now.listed)
        out.push_back(query_instance({m + 1}, members[m].rig, now.poses, i, now.layers.empty() ? ~0u : now.layers[i]));
    }
    for (std::uint32_t b = 0; b < bodies.size(); ++b) {
      Rig rig;
      rig.parents = {-1};
      rig.leaves = {{0, bodies[b].box, {}}};
      Poses poses;
      poses.link_count = poses.instance_count = 1;
      poses.data.assign(bodies[b].rotation, bodies[b].rotation + 4);
      poses.data.insert(poses.data.end(), 3, 0.0f);
      poses.origins.assign(bodies[b].origin, bodies[b].origin + 3);
      out.push_back(query_instance({static_cast<std::uint32_t>(members.size() + 1)}, rig, poses, 0));
      out.back().instance = b;
    }
    return out;
  }
};

struct PastShape {
  std::uint32_t most_instances = 17;
  bool with_bodies = true;
  bool with_matrices = false;
};

Moment any_moment(Random& random, const Member& member, PoseFormat format, const PoseRange& range, double time) {
  Moment out;
  PoseRange here = range;
  if (random.chance(0.2)) here.orientations = !here.orientations;
  out.time = time;
  out.poses = random_poses(random, member.rig, member.instances, format, here);
  const std::uint32_t count = member.instances;
  if (format == PoseFormat::kQuaternionTranslation)
    for (std::uint32_t i = 0; i < count; ++i)
      for (std::uint32_t link = 0; link < out.poses.link_count && random.chance(0.3); ++link) {
        const auto by = static_cast<float>((random.chance(0.5) ? 1 : -1) * random.log_uniform(0.01, 100));
        for (int c = 0; c < 4; ++c) out.poses.pose(i, link)[c] *= by;
      }
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < count; ++i)
      out.poses.scales.push_back(static_cast<float>(random.log_uniform(0.1, 10)));
  if (random.chance(0.3))
    for (std::uint32_t i = 0; i < count; ++i) out.layers.push_back(1u << random.index(3));
  out.present.assign(count, true);
  const bool all = random.chance(0.6);
  for (std::uint32_t i = 0; i < count; ++i) {
    out.present[i] = all || random.chance(0.8);
    if (!out.present[i]) continue;
    out.listed.push_back(i);
    if (!random.chance(0.05)) continue;
    out.poses.pose(i, member.rig.leaves[0].link)[random.index(3)] = kNan;
    out.present[i] = false;
  }
  return out;
}

std::unique_ptr<Past> any_past(Random& random, const PastShape& shape = {}) {
  auto out = std::make_unique<Past>();
  const bool far = random.chance(0.3);
  const Vec3<double> about = (far ? random.log_uniform(1e3, 1e7) : 0) * random.unit_vector();
  const double spread = random.uniform(0.3, 3);
  const std::uint32_t moments = 1 + random.index(6);
  out->kept = 1 + random.index(5);
  std::vector<double> times = {random.uniform(-10, 10)};
  for (std::uint32_t t = 1; t < moments; ++t) times.push_back(times.back() + random.log_uniform(1e-3, 1));
  for (std::uint32_t left = 1 + random.index(3); left > 0; --left) {
    Member& member = out->members.emplace_back();
    member.rig = any_rig(random, 8);
    if (random.chance(0.2)) flatten_leaves(random, member.rig);
    if (random.chance(0.6)) add_parts(random, member.rig, out->parts);
    member.instances = 1 + random.index(shape.most_instances);
    const auto format = static_cast<PoseFormat>(shape.with_matrices ? 1 + random.index(2) : 0);
    const PoseRange range = any_pose_range(random, far, about, spread);
    for (const double time : times) member.moments.push_back(any_moment(random, member, format, range, time));
    // Small steps too: every second history goes on from its first moment.
    for (std::size_t t = 1; t < times.size() && format == PoseFormat::kQuaternionTranslation && left % 2 == 0; ++t) {
      Moment& to = member.moments[t];
      const auto nudge = [&](auto& x) { x += static_cast<std::decay_t<decltype(x)>>(random.uniform(-0.02, 0.02)); };
      to.poses = member.moments[t - 1].poses;
      for (float& x : to.poses.data) nudge(x);
      for (double& x : to.poses.origins) nudge(x);
      to.present = member.moments[t - 1].present;
      to.listed = member.moments[t - 1].listed;
    }
  }
  for (std::uint32_t left = shape.with_bodies && random.chance(0.4) ? 1 + random.index(5) : 0; left > 0; --left) {
    StaticBody body;
    body.box = random_box(random, {}, 0.02, 0.3);
    for (std::size_t c = 0; c < 3; ++c) body.origin[c] = about[c] + random.uniform(-spread, spread);
    out->bodies.push_back(body);
  }
  return out;
}

// Times at moments, between two of them, and out of range.
std::vector<double> any_times(Random& random, const Past& past) {
  const std::vector<double> all = past.times();
  std::vector<double> out = {all.back(), all[random.index(static_cast<unsigned>(all.size()))]};
  if (random.chance(0.3)) out.push_back(all.front() - 1);
  if (random.chance(0.3)) out.push_back(all.back() + 1);
  for (int i = 0; i < 3 && all.size() > 1; ++i) {
    const std::size_t t = 1 + random.index(static_cast<unsigned>(all.size() - 1));
    out.push_back(all[t - 1] + random.uniform(0, 1) * (all[t] - all[t - 1]));
  }
  return out;
}

// ----------------------------------------------------------------------------------------------------------- calls

struct Answer {
  std::vector<QueryHit> hits;
  std::vector<std::uint8_t> found;
  QueryStats stats;
};

Answer ask(Engine& engine, const std::vector<BatchInput>& inputs, const std::vector<HistoryId>& histories,
           const RandomQueries& about, Exact exact, std::size_t room = 4096) {
  Answer out;
  out.hits.resize(room);
  out.found.assign(about.queries.size(), 0xee);
  QueryJob job;
  job.inputs = inputs;
  job.histories = histories;
  job.queries = about.queries;
  job.planes = about.planes;
  job.exact = exact;
  job.hits = out.hits;
  job.found = out.found;
  Status status = run_queries(engine, job);
  if (status == Status::kHitsOverflow) {
    CHECK(job.hit_count == 0);
    out.hits.resize(job.hits_needed);
    job.hits = out.hits;
    status = run_queries(engine, job);
  }
  CHECK(status == Status::kOk);
  CHECK(job.hit_count == job.hits_needed);
  out.hits.resize(job.hit_count);
  out.stats = job.stats;
  return out;
}

bool same_hits(const std::vector<QueryHit>& a, const std::vector<QueryHit>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const QueryHit& x, const QueryHit& y) {
    return std::memcmp(&x, &y, offsetof(QueryHit, inside)) == 0 && x.inside == y.inside;
  });
}

bool same_counts(const QueryStats& a, const QueryStats& b) {
  return a.nodes == b.nodes && a.instances == b.instances && a.leaf_tests == b.leaf_tests &&
         a.exact_tests == b.exact_tests && a.clamped == b.clamped;
}

std::vector<QueryHit> hits_of(const std::vector<QueryHit>& hits, std::size_t begin, std::size_t end) {
  std::vector<QueryHit> out;
  for (const QueryHit& hit : hits)
    if (hit.query >= begin && hit.query < end) {
      out.push_back(hit);
      out.back().query -= static_cast<std::uint32_t>(begin);
    }
  return out;
}

// Queries about a world at several times, those of one time after the other.
struct Asked {
  std::vector<double> times;
  std::vector<std::size_t> begin;  // of each time, and the end
  RandomQueries about;

  // Those of one time, as about the present.
  RandomQueries now(std::size_t t) const {
    RandomQueries out;
    out.planes = about.planes;
    for (std::size_t q = begin[t]; q < begin[t + 1]; ++q) {
      out.queries.push_back(about.queries[q]);
      out.queries.back().time = kNow;
    }
    return out;
  }
};

Asked any_queries(Random& random, const Past& past, std::uint32_t per_time) {
  Asked out;
  out.times = any_times(random, past);
  for (const double time : out.times) {
    out.begin.push_back(out.about.queries.size());
    const QueryScene scene = past.scene(time);
    if (std::any_of(scene.begin(), scene.end(), [](const auto& one) { return !one.leaves.empty(); }))
      add_queries(random, scene, per_time, out.about);
    for (std::size_t q = out.begin.back(); q < out.about.queries.size(); ++q) out.about.queries[q].time = time;
  }
  out.begin.push_back(out.about.queries.size());
  return out;
}

std::vector<BatchInput> static_inputs(const Past& past) {
  return past.bodies.empty() ? std::vector<BatchInput>{} : std::vector<BatchInput>{past.body_input()};
}

// Makes room for some queries, and adds a history of a batch.
HistoryId add_history_of(Engine& engine, BatchId batch, std::uint32_t ticks, std::uint32_t queries) {
  require(reserve(engine, {0, 0, queries}));
  HistoryId out;
  require(add_history(engine, {batch, ticks}, &out));
  return out;
}

}  // namespace

TEST_CASE("history: queries about the past find what they find if the poses of then are those of now, bit for bit") {
  std::size_t hits = 0;
  for_seeds(60, [&](Random& random) {
    const auto past = any_past(random);
    const Asked asked = any_queries(random, *past, 25);
    for (const Exact exact : kBoth) {
      CAPTURE(static_cast<int>(exact));
      Answer first;
      for (const Isa isa : available_isas()) {
        CAPTURE(to_string(isa));
        std::vector<HistoryId> histories;
        EngineDesc desc;
        desc.isa = isa;
        const EnginePtr engine = past->engine(&histories, desc);
        const Answer answer = ask(*engine, static_inputs(*past), histories, asked.about, exact);
        if (isa != Isa::kScalar) {
          CHECK(same_hits(answer.hits, first.hits));
          CHECK(answer.found == first.found);
          CHECK(same_counts(answer.stats, first.stats));
          continue;
        }
        first = answer;
        hits += first.hits.size();
        for (std::size_t t = 0; t < asked.times.size(); ++t) {
          CAPTURE(t);
          std::vector<BatchInput> inputs = static_inputs(*past);
          std::vector<Moment> moments;
          for (const Member& member : past->members)
            moments.push_back(at_time(member.moments, past->kept, asked.times[t]));
          for (std::uint32_t m = 0; m < moments.size(); ++m) inputs.push_back(moments[m].input({m + 1}));
          const RandomQueries about = asked.now(t);
          const Answer now = ask(*engine, inputs, {}, about, exact);
          CHECK(same_hits(hits_of(first.hits, asked.begin[t], asked.begin[t + 1]), now.hits));
          for (std::size_t q = 0; q < now.found.size(); ++q) CHECK(now.found[q] == first.found[asked.begin[t] + q]);
        }
      }
    }
  });
  MESSAGE("hits: ", hits);
  if (runs_all_seeds()) CHECK(hits >= least_count(2000, 60));
}

TEST_CASE("history: what is answered about the past is right by the judge, also for poses given as matrices") {
  std::size_t hits = 0;
  for_seeds(40, [&](Random& random) {
    const bool with_matrices = random.chance(0.5);
    auto past = any_past(random, {9, true, with_matrices});
    std::vector<HistoryId> histories;
    const EnginePtr engine = past->engine(&histories);
    // The judge takes poses as quaternions where it is asked between two moments.
    for (Member& member : past->members)
      for (Moment& moment : member.moments) {
        if (moment.poses.format == PoseFormat::kQuaternionTranslation) continue;
        Poses given = moment.poses;
        given.scales.clear();
        given.orientations.clear();
        moment.poses.format = PoseFormat::kQuaternionTranslation;
        moment.poses.data.assign(std::size_t{7} * given.instance_count * given.link_count, 0.0f);
        for (std::uint32_t i = 0; i < given.instance_count; ++i)
          for (std::uint32_t link = 0; link < given.link_count; ++link) {
            const ExactPose pose = exact_pose(given, i, link);
            const auto& c = pose.column;  // by column
            const Real w = std::sqrt(std::max<Real>(0, 1 + c[0][0] + c[1][1] + c[2][2])) / 2;
            Real q[4] = {std::sqrt(std::max<Real>(0, 1 + c[0][0] - c[1][1] - c[2][2])) / 2,
                         std::sqrt(std::max<Real>(0, 1 - c[0][0] + c[1][1] - c[2][2])) / 2,
                         std::sqrt(std::max<Real>(0, 1 - c[0][0] - c[1][1] + c[2][2])) / 2, w};
            q[0] = std::copysign(q[0], c[1][2] - c[2][1]);
            q[1] = std::copysign(q[1], c[2][0] - c[0][2]);
            q[2] = std::copysign(q[2], c[0][1] - c[1][0]);
            float* const out = moment.poses.pose(i, link);
            for (int k = 0; k < 4; ++k) out[k] = static_cast<float>(q[k]);
            for (std::size_t k = 0; k < 3; ++k) out[4 + k] = static_cast<float>(pose.at[k]);
          }
      }
    const Asked asked = any_queries(random, *past, 20);
    for (const Exact exact : kBoth) {
      // A quaternion that was made of a matrix in another way may differ by its rounding: no query grazes by that.
      if (with_matrices && exact != Exact::kNone) continue;
      CAPTURE(static_cast<int>(exact));
      const Answer answer = ask(*engine, static_inputs(*past), histories, asked.about, exact);
      hits += answer.hits.size();
      for (std::size_t t = 0; t < asked.times.size(); ++t) {
        CAPTURE(t);
        const RandomQueries about = asked.now(t);
        std::vector<QueryHit> of_time = hits_of(answer.hits, asked.begin[t], asked.begin[t + 1]);
        std::vector<std::uint8_t> found(answer.found.begin() + static_cast<std::ptrdiff_t>(asked.begin[t]),
                                        answer.found.begin() + static_cast<std::ptrdiff_t>(asked.begin[t + 1]));
        QueryJob job;
        job.queries = about.queries;
        job.planes = about.planes;
        job.exact = exact;
        job.hits = of_time;
        job.found = found;
        job.hit_count = job.hits_needed = of_time.size();
        CHECK(fault_of(past->scene(asked.times[t]), job) == "");
      }
    }
  });
  if (runs_all_seeds()) CHECK(hits >= least_count(500, 40));
}

TEST_CASE("history: poses between two moments are within a few roundings of those in exact arithmetic") {
  Random random(7);
  double worst = 0;
  for (int round = 0; round < 100000; ++round) {
    double turns[2][4];
    float q[2][4], mid[4];
    for (int m = 0; m < 2; ++m) {
      random_turn(random, turns[m]);
      const double by = random.log_uniform(1e-2, 1e2);
      for (int c = 0; c < 4; ++c) q[m][c] = static_cast<float>(by * turns[m][c]);
    }
    const auto part = static_cast<float>(random.uniform(0, 1));
    blend(q[0], q[1], part, mid);
    Real length[2], exact[4], sum = 0, product = 0, mid_length = 0;
    for (int m = 0; m < 2; ++m) {
      Real square = 0;
      for (const float c : q[m]) square += static_cast<Real>(c) * static_cast<Real>(c);
      length[m] = std::sqrt(square);
    }
    for (int c = 0; c < 4; ++c) product += static_cast<Real>(q[0][c]) * static_cast<Real>(q[1][c]);
    for (int c = 0; c < 4; ++c) {
      const Real p = static_cast<Real>(part);
      exact[c] = (1 - p) * static_cast<Real>(q[0][c]) / length[0] +
                 (product < 0 ? -p : p) * static_cast<Real>(q[1][c]) / length[1];
      sum += exact[c] * exact[c];
      mid_length += static_cast<Real>(mid[c]) * static_cast<Real>(mid[c]);
    }
    Real off = 0;
    for (int c = 0; c < 4; ++c) {
      const Real d = exact[c] / std::sqrt(sum) - static_cast<Real>(mid[c]) / std::sqrt(mid_length);
      off += d * d;
    }
    worst = std::max(worst, static_cast<double>(2 * std::sqrt(off)));  // a point at 1 moves by twice that
  }
  constexpr double kMostMoved = 13 * 0x1p-24;  // docs/proof.md, step 13.4; the worst found is 4.3 u
  CHECK(worst < kMostMoved);
  MESSAGE("a point at distance 1 is moved by at most ", worst * 0x1p24, " u");
}

TEST_CASE("history: the ring keeps the last moments, and a time out of range counts as the nearest of them") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 1);
  const HistoryId history = add_history_of(*engine, batch, 3, 4);
  HistorySpan span;
  require(history_span(*engine, history, &span));
  CHECK(span.ticks == 0);
  const auto distance_at = [&](double time, std::uint64_t clamped) {
    RandomQueries about;
    Query& query = about.queries.emplace_back();
    query.position[0] = -100;
    query.direction[0] = 1;
    query.length = 1000;
    query.time = time;
    const Answer answer = ask(*engine, {}, {history}, about, Exact::kNone);
    CHECK(answer.stats.clamped == clamped);
    return answer.hits.empty() ? -1.0f : answer.hits[0].distance;
  };
  CHECK(distance_at(0, 0) == -1);
  for (int tick = 0; tick < 8; ++tick) {
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, static_cast<float>(10 * tick), 0, 0};
    require(record_tick(*engine, history, poses.input(batch), tick));
    require(history_span(*engine, history, &span));
    CHECK(span.ticks == static_cast<std::uint32_t>(std::min(tick + 1, 3)));
    CHECK(span.first == std::max(tick - 2, 0));
    CHECK(span.last == tick);
    const float first = static_cast<float>(10 * std::max(tick - 2, 0)), last = static_cast<float>(10 * tick);
    CHECK(distance_at(-1, 1) == doctest::Approx(99 + first));
    CHECK(distance_at(tick, 0) == doctest::Approx(99 + last));
    CHECK(distance_at(tick + 0.5, 1) == doctest::Approx(99 + last));
    if (tick > 0) CHECK(distance_at(tick - 0.5, 0) == doctest::Approx(99 + last - 5));
  }
}

TEST_CASE("history: a link that turns by half a turn between two moments is found all along its arc") {
  Rig rig;
  rig.parents = {-1};
  Box box = kUnitBox;
  box.center[0] = 10;
  for (float& half : box.half) half = 0.1f;
  rig.leaves = {{0, box, {}}};
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 1);
  const HistoryId history = add_history_of(*engine, batch, 2, 4);
  for (int tick = 0; tick < 2; ++tick) {
    Poses poses;
    poses.link_count = poses.instance_count = 1;
    poses.data = {0, 0, tick ? 1.0f : 0.0f, tick ? 1e-3f : 1.0f, 0, 0, 0};
    require(record_tick(*engine, history, poses.input(batch), tick));
  }
  RandomQueries about;
  for (int i = 0; i <= 20; ++i) {
    const double t = i / 20.0, angle = 2 * std::atan2(t, (1 - t) + 1e-3 * t);
    Query& query = about.queries.emplace_back();
    query.kind = QueryKind::kSphere;
    query.want = QueryWant::kAny;
    query.radius = 0.05f;
    query.position[0] = 10 * std::cos(angle);
    query.position[1] = 10 * std::sin(angle);
    query.time = t;
  }
  const Answer answer = ask(*engine, {}, {history}, about, Exact::kNone);
  CHECK(answer.found == std::vector<std::uint8_t>(21, 1));
}

TEST_CASE("history: every link of an instance is found along its arc, not only the first") {
  Rig rig;
  rig.parents = {-1, 0};
  Box small = kUnitBox, far = kUnitBox;
  far.center[0] = 10;
  for (float* half : {small.half, far.half}) std::fill_n(half, 3, 0.1f);
  rig.leaves = {{0, small, {}}, {1, far, {}}};
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 1);
  const HistoryId history = add_history_of(*engine, batch, 2, 1);
  // Link 1 turns from 45 degrees on one side of x to 45 degrees on the other.
  const float s = std::sin(0.3926990817f), c = std::cos(0.3926990817f);
  for (int tick = 0; tick < 2; ++tick) {
    Poses poses;
    poses.link_count = 2;
    poses.instance_count = 1;
    poses.data = {0, 0, 0, 1, 0, 0, 0, 0, 0, tick ? s : -s, c, 0, 0, 0};
    require(record_tick(*engine, history, poses.input(batch), tick));
  }
  RandomQueries about;
  Query& query = about.queries.emplace_back();
  query.kind = QueryKind::kSphere;
  query.want = QueryWant::kAny;
  query.radius = 0.05f;
  query.position[0] = 10;
  query.time = 0.5;
  CHECK(ask(*engine, {}, {history}, about, Exact::kNone).found == std::vector<std::uint8_t>{1});
}

TEST_CASE("history: a level of boxes is at a moment what it is now, bit for bit") {
  Rig rig;
  rig.parents = {-1, 0};
  rig.leaves = {{0, kUnitBox, {}}, {1, kUnitBox, {}}};
  const EnginePtr engine = make_engine();
  const float rest[] = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  LodDesc lod;
  lod.of = add_rig(*engine, rig);
  lod.rest_poses.data = rest;
  ArticulationId level;
  require(add_lod(*engine, lod, &level));
  const BatchId batch = add_instances(*engine, level, 1);
  const HistoryId history = add_history_of(*engine, batch, 1, 2);
  Poses poses;
  poses.link_count = 2;
  poses.instance_count = 1;
  poses.data = {0.1f, 0.2f, -0.3f, 0.9f, 0.3f, 0.1f, 0.7f, 0.1f, 0.2f, -0.3f, 0.9f, 0.3f, 0.1f, 0.7f};
  require(record_tick(*engine, history, poses.input(batch), 0));
  RandomQueries about;
  // Rays and points pose boxes in different ways. They begin near the box, where padding changes distances.
  constexpr std::uint32_t kCount = 50;
  for (const double time : {kNow, 0.0})
    for (std::uint32_t q = 0; q < kCount; ++q) {
      Query& query = about.queries.emplace_back();
      query.kind = q % 2 ? QueryKind::kPoint : QueryKind::kRay;
      query.position[0] = -3;
      query.position[1] = 0.2 * (q % 5) - 0.3;
      query.position[2] = 0.2 * (q / 10) + 0.3;
      query.direction[0] = 1;
      query.length = 100;
      query.time = time;
    }
  Answer answer = ask(*engine, {poses.input(batch)}, {history}, about, Exact::kNone);
  REQUIRE(answer.hits.size() == 2 * kCount);
  for (std::uint32_t q = 0; q < kCount; ++q) {
    CHECK(answer.hits[q].distance > 0);
    answer.hits[kCount + q].query = q;
    CHECK(same_hits({answer.hits[q]}, {answer.hits[kCount + q]}));
  }
}

TEST_CASE("history: a small link is found wherever it is between two moments, however its instance turns and grows") {
  Random random(11);
  constexpr std::uint32_t kCount = 64;
  const EnginePtr engine = make_engine();
  for (int round = 0; round < 40; ++round) {
    CAPTURE(round);
    Rig rig;
    rig.parents = {-1};
    const Vec3<double> place = random.chance(0.5) ? random.log_uniform(0.1, 10) * random.unit_vector() : Vec3<double>{};
    rig.leaves = {{0, random_box(random, place, 1e-4, 2e-4), {}}};
    rig.parent_offset = {Vec3<double>{}};
    const BatchId batch = add_instances(*engine, add_rig(*engine, rig), kCount);
    const HistoryId history = add_history_of(*engine, batch, 2, kCount);
    // What changes between the two moments, alone and together.
    const unsigned changes = static_cast<unsigned>(round) % 8;
    std::vector<Moment> moments(2);
    for (Moment& moment : moments) {
      PoseRange range;
      range.origins = true;
      range.orientations = true;
      range.spread = random.log_uniform(0.01, 10);
      moment.poses = random_poses(random, rig, kCount, PoseFormat::kQuaternionTranslation, range);
      for (std::uint32_t i = 0; i < kCount; ++i) {
        for (int c = 0; c < 3; ++c) moment.poses.pose(i, 0)[4 + c] = static_cast<float>(random.uniform(-3, 3));
        moment.poses.scales.push_back(static_cast<float>(random.log_uniform(0.1, 10)));
      }
      moment.layers.clear();
      moment.present.assign(kCount, true);
    }
    moments[1].time = 1;
    if (!(changes & 1)) moments[1].poses.orientations = moments[0].poses.orientations;
    if (!(changes & 2)) moments[1].poses.scales = moments[0].poses.scales;
    if (!(changes & 4)) moments[1].poses.data = moments[0].poses.data;
    for (const Moment& moment : moments) require(record_tick(*engine, history, moment.poses.input(batch), moment.time));
    RandomQueries about;
    for (std::uint32_t i = 0; i < kCount; ++i) {
      Query& query = about.queries.emplace_back();
      query.kind = QueryKind::kSphere;
      query.want = QueryWant::kAll;
      query.radius = 1e-6f;
      query.time = random.chance(0.5) ? 0.5 : random.uniform(0, 1);
      const Moment then = between(moments[0], moments[1], query.time);
      const QueryInstance one = query_instance({1}, rig, then.poses, i);
      for (std::size_t c = 0; c < 3; ++c)
        query.position[c] = static_cast<double>(one.origin[c]) + static_cast<double>(one.leaves[0].box.box.center[c]);
    }
    const Answer answer = ask(*engine, {}, {history}, about, Exact::kNone);
    for (std::uint32_t i = 0; i < kCount; ++i)
      CHECK(std::any_of(answer.hits.begin(), answer.hits.end(),
                        [i](const QueryHit& hit) { return hit.query == i && hit.instance == i; }));
    require(remove_history(*engine, history));
    require(remove_batch(*engine, batch));
  }
}

TEST_CASE("history: answers depend neither on threads, nor on the room, nor on the other queries of a call") {
  for_seeds(12, [&](Random& random) {
    const auto past = any_past(random, {40, true, false});
    const Asked asked = any_queries(random, *past, 60);
    std::vector<HistoryId> histories;
    const EnginePtr engine = past->engine(&histories);
    for (const Exact exact : kBoth) {
      const Answer first = ask(*engine, static_inputs(*past), histories, asked.about, exact);
      ThreadPool pool(3);
      const Scheduler scheduler = pool.scheduler();
      EngineDesc desc;
      desc.scheduler = &scheduler;
      std::vector<HistoryId> other;
      const EnginePtr threaded = past->engine(&other, desc, 1 + random.index(200));
      const Answer again = ask(*threaded, static_inputs(*past), other, asked.about, exact, 0);
      CHECK(same_hits(again.hits, first.hits));
      CHECK(again.found == first.found);
      CHECK(same_counts(again.stats, first.stats));
      std::reverse(other.begin(), other.end());
      CHECK(same_hits(ask(*threaded, static_inputs(*past), other, asked.about, exact).hits, first.hits));
      for (int i = 0; i < 5 && !asked.about.queries.empty(); ++i) {
        const std::size_t q = random.index(static_cast<unsigned>(asked.about.queries.size()));
        RandomQueries one;
        one.planes = asked.about.planes;
        one.queries = {asked.about.queries[q]};
        const Answer alone = ask(*engine, static_inputs(*past), histories, one, exact);
        CHECK(same_hits(alone.hits, hits_of(first.hits, q, q + 1)));
      }
    }
  });
}

TEST_CASE("history: a query that meets more instances than are posed together is answered as any other") {
  Random random(5);
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  constexpr std::uint32_t kCount = 1500;
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), kCount);
  const HistoryId history = add_history_of(*engine, batch, 2, 8);
  PoseRange range;
  range.spread = 20;
  range.origins = true;
  std::vector<Poses> poses;
  for (int tick = 0; tick < 2; ++tick) {
    rig.parent_offset = {Vec3<double>{}};
    poses.push_back(random_poses(random, rig, kCount, PoseFormat::kQuaternionTranslation, range));
    require(record_tick(*engine, history, poses.back().input(batch), tick));
  }
  RandomQueries about;
  for (int i = 0; i < 30; ++i) {
    Query& query = about.queries.emplace_back();
    query.kind = i % 2 ? QueryKind::kSphere : QueryKind::kRay;
    query.want = i % 3 ? QueryWant::kAll : QueryWant::kClosest;
    query.radius = i % 2 ? 15.0f : 3.0f;
    query.direction[i % 3] = 1;
    query.position[i % 3] = -10;
    query.length = 100;
    query.time = 1;
  }
  const Answer past = ask(*engine, {}, {history}, about, Exact::kNone);
  CHECK(past.hits.size() > kCount);
  for (Query& query : about.queries) query.time = kNow;
  CHECK(same_hits(past.hits, ask(*engine, {poses[1].input(batch)}, {}, about, Exact::kNone).hits));
}

TEST_CASE("history: a ray that begins inside many links of several players finds the first of them") {
  Random random(11);
  Rig rig;
  rig.parents = {-1};
  rig.leaves.assign(20, {0, kUnitBox, {}});
  const EnginePtr engine = make_engine();
  constexpr std::uint32_t kCount = 40;
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), kCount);
  const HistoryId history = add_history_of(*engine, batch, 2, 64);
  PoseRange range;
  range.spread = 0.2;  // all of them overlap
  range.origins = true;
  rig.parent_offset = {Vec3<double>{}};
  const Poses poses = random_poses(random, rig, kCount, PoseFormat::kQuaternionTranslation, range);
  require(record_tick(*engine, history, poses.input(batch), 1));
  RandomQueries about;
  for (int i = 0; i < 40; ++i) {
    Query& query = about.queries.emplace_back();
    query.want = i % 4 == 3 ? QueryWant::kAny : QueryWant::kClosest;
    query.direction[i % 3] = 1;
    query.position[i % 3] = i % 2 ? 0 : -10;
    query.length = 100;
    query.time = i % 5 ? 1 : 0;  // before the first moment
  }
  const Answer past = ask(*engine, {}, {history}, about, Exact::kNone);
  CHECK(past.stats.clamped == 8);
  for (Query& query : about.queries) query.time = kNow;
  const Answer now = ask(*engine, {poses.input(batch)}, {}, about, Exact::kNone);
  CHECK(past.hits.size() == 30);
  CHECK(same_hits(past.hits, now.hits));
  CHECK(past.found == now.found);
}

TEST_CASE("history: neither recording nor asking takes memory, and what a history takes is counted and given back") {
  struct Counter {
    std::uint64_t calls = 0;
    static void* allocate(void* user, std::size_t bytes, std::size_t alignment) {
      ++static_cast<Counter*>(user)->calls;
      return tests::allocate_aligned(bytes, alignment);
    }
    static void release(void*, void* memory, std::size_t, std::size_t) { tests::free_aligned(memory); }
  };
  for_seeds(4, [&](Random& random) {
    const auto past = any_past(random);
    const Asked asked = any_queries(random, *past, 20);
    Counter counter;
    const Allocator allocator = {&counter, Counter::allocate, Counter::release};
    EngineDesc desc;
    desc.allocator = &allocator;
    std::vector<HistoryId> histories;
    const EnginePtr engine = past->engine(&histories, desc, 16);
    const std::uint64_t before = counter.calls;
    EngineMemory memory, less;
    require(engine_memory(*engine, &memory));
    CHECK(memory.histories > 0);
    CHECK(memory.total >= memory.histories);
    for (int i = 0; i < 3; ++i)
      for (std::uint32_t m = 0; m < past->members.size(); ++m)
        require(record_tick(*engine, histories[m], past->members[m].moments[0].input({m + 1}), 1000 + i));
    for (const Exact exact : kBoth) ask(*engine, static_inputs(*past), histories, asked.about, exact);
    CHECK(counter.calls == before);
    require(remove_history(*engine, histories[0]));
    require(engine_memory(*engine, &less));
    CHECK(less.histories < memory.histories);
  });
}

TEST_CASE("history: queries of now do not see the past, queries of the past do not see the inputs of now") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 2);
  const HistoryId history = add_history_of(*engine, batch, 2, 4);
  Poses then;
  then.link_count = 1;
  then.instance_count = 2;
  then.data = {0, 0, 0, 1, 10, 0, 0, 0, 0, 0, 1, 20, 0, 0};
  Poses now = then;
  now.data[4] = 30;
  now.data[11] = 40;
  require(record_tick(*engine, history, then.input(batch), 0));
  RandomQueries about;
  Query ray;
  ray.direction[0] = 1;
  ray.length = 100;
  about.queries = {ray, ray, ray};
  about.queries[1].time = 0;
  about.queries[2].time = 0;
  about.queries[2].ignored_batch = batch;
  about.queries[2].ignored_instance = 0;
  const Answer answer = ask(*engine, {now.input(batch)}, {history}, about, Exact::kConvex);
  REQUIRE(answer.hits.size() == 3);
  CHECK(answer.hits[0].distance == doctest::Approx(29));
  CHECK(answer.hits[1].distance == doctest::Approx(9));
  CHECK(answer.hits[2].distance == doctest::Approx(19));
  CHECK(answer.hits[2].instance == 1);
}

TEST_CASE("history: what a call must not be given is refused by its status, and no moment is lost") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const EnginePtr engine = make_engine();
  const ArticulationId articulation = add_rig(*engine, rig);
  const BatchId batch = add_instances(*engine, articulation, 2);
  const BatchId other = add_instances(*engine, articulation, 2);
  const BatchId sequence = add_instances(*engine, articulation, 2, BatchKind::kSequence);
  ReserveDesc room;
  room.queries = 4;
  require(reserve(*engine, room));
  HistoryId history, second;
  HistoryDesc desc;
  desc.batch = batch;
  desc.ticks = 2;
  CHECK(add_history(*engine, desc, nullptr) == Status::kBadOutput);
  const auto refused = [&](BatchId of, std::uint32_t ticks) {
    HistoryDesc bad;
    bad.batch = of;
    bad.ticks = ticks;
    return add_history(*engine, bad, &history);
  };
  CHECK(refused({77}, 2) == Status::kUnknownBatch);
  CHECK(refused(sequence, 2) == Status::kBadBatchKind);
  CHECK(refused(batch, 0) == Status::kBadTicks);
  CHECK(refused(batch, kMaxTicks + 1) == Status::kBadTicks);
  CHECK(history.value == 0);
  require(add_history(*engine, desc, &history));
  require(add_history(*engine, desc, &second));

  Poses poses;
  poses.link_count = 1;
  poses.instance_count = 2;
  poses.data = {0, 0, 0, 1, 10, 0, 0, 0, 0, 0, 1, 20, 0, 0};
  CHECK(record_tick(*engine, {99}, poses.input(batch), 0) == Status::kUnknownHistory);
  CHECK(record_tick(*engine, history, poses.input(other), 0) == Status::kUnknownBatch);
  CHECK(record_tick(*engine, history, poses.input(batch), kNoTime) == Status::kBadTime);
  CHECK(record_tick(*engine, history, poses.input(batch), kNow) == Status::kBadTime);
  require(record_tick(*engine, history, poses.input(batch), 1));
  require(record_tick(*engine, history, poses.input(batch), 2));
  CHECK(record_tick(*engine, history, poses.input(batch), 2) == Status::kBadTime);
  CHECK(record_tick(*engine, history, poses.input(batch), 1.5) == Status::kBadTime);
  BatchInput bad = poses.input(batch);
  bad.poses.data = nullptr;
  CHECK(record_tick(*engine, history, bad, 3) == Status::kBadPoses);
  Poses matrices = poses;
  matrices.format = PoseFormat::kMatrix3x4Rows;
  matrices.data = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0};
  CHECK(record_tick(*engine, history, matrices.input(batch), 3) == Status::kBadHistoryPoses);
  matrices.data[22] = 1;
  matrices.has_scale = true;
  CHECK(record_tick(*engine, history, matrices.input(batch), 3) == Status::kBadHistoryPoses);
  HistorySpan span;
  require(history_span(*engine, history, &span));
  CHECK(span.ticks == 2);
  CHECK(span.first == 1);
  CHECK(span.last == 2);
  CHECK(history_span(*engine, history, nullptr) == Status::kBadOutput);
  CHECK(history_span(*engine, {99}, &span) == Status::kUnknownHistory);

  Query query;
  query.direction[0] = 1;
  query.length = 100;
  query.time = 1;
  QueryHit hits[4];
  const auto run = [&](std::vector<HistoryId> ids, const Query& one) {
    QueryJob job;
    job.queries = {&one, 1};
    job.histories = ids;
    job.hits = {hits, 4};
    return run_queries(*engine, job);
  };
  CHECK(run({history}, query) == Status::kOk);
  CHECK(run({}, query) == Status::kOk);
  CHECK(run({history, second}, query) == Status::kHistoryGivenTwice);
  CHECK(run({{99}}, query) == Status::kUnknownHistory);
  Query no_time = query;
  for (const double time : {kNoTime, -kNow}) {
    no_time.time = time;
    CHECK(run({history}, no_time) == Status::kBadQuery);
  }
  QueryJob no_data;
  no_data.histories = {nullptr, 1};
  CHECK(run_queries(*engine, no_data) == Status::kUnknownHistory);

  require(remove_history(*engine, second));
  CHECK(remove_history(*engine, second) == Status::kUnknownHistory);
  CHECK(run({second}, query) == Status::kUnknownHistory);
  HistoryId third;
  require(add_history(*engine, desc, &third));
  CHECK(third.value != second.value);
  CHECK(slot_of(BatchId{third.value}).value == slot_of(BatchId{second.value}).value);
  CHECK(record_tick(*engine, second, poses.input(batch), 0) == Status::kUnknownHistory);

  require(remove_batch(*engine, batch));
  CHECK(run({history}, query) == Status::kUnknownBatch);
  CHECK(record_tick(*engine, history, poses.input(batch), 3) == Status::kUnknownBatch);
  const BatchId again = add_instances(*engine, articulation, 2);
  CHECK(slot_of(again).value == slot_of(batch).value);
  CHECK(run({history}, query) == Status::kUnknownBatch);
  CHECK(record_tick(*engine, history, poses.input(again), 3) == Status::kUnknownBatch);
  CHECK(remove_history(*engine, history) == Status::kOk);
}

TEST_CASE("history: an instance that only one of two moments has is absent between them") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves.resize(1);
  for (float& half : rig.leaves[0].box.half) half = 1;
  const EnginePtr engine = make_engine();
  const BatchId batch = add_instances(*engine, add_rig(*engine, rig), 2);
  const HistoryId history = add_history_of(*engine, batch, 3, 16);
  const std::vector<float> poses = {0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0};
  const std::vector<double> origins = {0, 0, 0, 10, 0, 0};
  const std::vector<std::uint32_t> first = {0}, both = {0, 1};
  // Where the later ones lack an instance, an earlier one has left its pose.
  const std::vector<std::vector<std::uint32_t>> given = {both, first, both, both, both, both, both, first, both};
  for (std::size_t tick = 0; tick < given.size(); ++tick) {
    BatchInput input;
    input.batch = batch;
    input.poses.data = poses.data();
    input.origins = origins;
    input.instances = given[tick];
    require(record_tick(*engine, history, input, static_cast<double>(tick)));
    for (const double part : {0.0, 0.5}) {
      const double time = static_cast<double>(tick) - part;
      const bool is_there = given[tick].size() == 2 && (part == 0 || tick == 0 || given[tick - 1].size() == 2);
      for (const QueryWant want : {QueryWant::kAny, QueryWant::kClosest, QueryWant::kAll})
        for (const QueryKind kind : {QueryKind::kRay, QueryKind::kPoint}) {
          Query query;
          query.kind = kind;
          query.want = want;
          query.time = time;
          query.position[0] = 10;
          query.position[2] = 5;
          query.direction[2] = -1;
          query.length = 5;
          QueryHit hit = {};
          std::uint8_t found = 0xee;
          QueryJob job;
          job.histories = {&history, 1};
          job.queries = {&query, 1};
          job.hits = {&hit, 1};
          job.found = {&found, 1};
          CAPTURE(time);
          CAPTURE(static_cast<int>(want));
          CAPTURE(static_cast<int>(kind));
          CHECK(run_queries(*engine, job) == Status::kOk);
          CHECK(found == is_there);
        }
    }
  }
}

TEST_CASE("history: one without a moment hides nothing of the others of a call") {
  Rig rig;
  rig.parents = {-1};
  rig.leaves = {{0, kUnitBox, {}}};
  const EnginePtr engine = make_engine();
  const ArticulationId articulation = add_rig(*engine, rig);
  std::vector<HistoryId> histories;
  for (int h = 0; h < 3; ++h)
    histories.push_back(add_history_of(*engine, add_instances(*engine, articulation, 1), 2, 8));
  Poses poses;
  poses.link_count = poses.instance_count = 1;
  poses.data = {0, 0, 0, 1, 10, 0, 0};
  require(record_tick(*engine, histories[1], poses.input({2}), 0));
  RandomQueries about;
  for (const QueryWant want : {QueryWant::kAny, QueryWant::kClosest, QueryWant::kAll})
    for (const QueryKind kind : {QueryKind::kRay, QueryKind::kSphere}) {
      Query query;
      query.kind = kind;
      query.want = want;
      query.time = 0;
      query.direction[0] = 1;
      query.length = 100;
      query.radius = 50;
      about.queries.push_back(query);
    }
  for (const std::uint8_t found : ask(*engine, {}, histories, about, Exact::kNone).found) CHECK(found == 1);
}

}  // namespace cab::tests
