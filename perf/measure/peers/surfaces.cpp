// `cab peers --surfaces`: what each model of two skins in contact, or of a crowd, costs and finds, by cab and others.
#include "perf/measure/peers/surfaces.h"

#include <cab/cab.h>
#include <cab/version.h>

#include <algorithm>
#include <functional>
#include <iostream>
#include <iterator>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <stdexcept>
#include <utility>

#include "perf/base/engine_call.h"
#include "perf/base/processor_time.h"
#include "perf/base/report.h"
#include "perf/base/usage.h"
#include "perf/measure/peers/surface_rivals.h"
#include "scenes/import/companions.h"

namespace cab::perf {
namespace {

using Json = nlohmann::ordered_json;

// What a set-up answers in a frame: links of two instances that touch, and triangles if it names them.
struct Answer {
  std::set<InstanceLinks> links;
  std::vector<InstanceTriangles> triangles;
};

// Seconds of a frame.
constexpr double kSlow = 0.1;

// What characters are made of.
enum class Model : std::uint8_t { kLevel, kStillBoxes, kGrownBoxes, kHulls, kSurface, kTriangles };

// The engine with all instances of a world, on one thread.
class Engines {
 public:
  Engines(const SurfaceWorld& world, Isa isa, Model model) : world_(world), model_(model) {
    EngineDesc desc;
    desc.isa = isa;
    desc.thread_count = 1;
    engine_ = make_engine(desc);
    job_.policies.exact = model == Model::kHulls                                   ? Exact::kConvex
                          : model == Model::kSurface || model == Model::kTriangles ? Exact::kSurface
                                                                                   : Exact::kNone;
    for (std::uint32_t a = 0; a < world.actors.size(); ++a) add_actor(a);
    for (std::size_t a = 0; a < inputs_.size(); ++a)
      for (std::size_t b = a; b < inputs_.size(); ++b) rules_.push_back({inputs_[a].batch, inputs_[b].batch});
  }

  // Poses are the caller's, so they are made before the time is taken.
  void run(std::uint32_t frame) {
    for (std::size_t a = 0; a < inputs_.size(); ++a) {
      inputs_[a].poses.data = poses_[frame][a].data();
      inputs_[a].origins = origins_[frame][a];
    }
    job_.inputs = inputs_;
    job_.rules = rules_;
    require(run_with_room(job_, hits_, nullptr, [&] { return run_frame(*engine_, job_); }), "a frame");
    if (model_ != Model::kTriangles) return;
    const Span<const Hit> hits = {hits_.data(), job_.hit_count};
    std::size_t needed = 0;
    Status status = cab::find_touching_triangles(*engine_, inputs_, hits, touching_, &needed);
    if (status == Status::kHitsOverflow) {
      touching_.resize(needed + needed / 4);
      status = cab::find_touching_triangles(*engine_, inputs_, hits, touching_, &needed);
    }
    require(status, "triangles");
    found_ = needed;
  }

  Answer answer() const {
    Answer out;
    const auto index = [this](BatchSlot slot, std::uint32_t instance) { return number_[slot.value - 1][instance]; };
    for (std::size_t h = 0; h < job_.hit_count; ++h) {
      const Hit& hit = hits_[h];
      InstanceLinks links = {index(hit.batch_a, hit.instance_a), hit.link_a, index(hit.batch_b, hit.instance_b),
                             hit.link_b};
      if (links.instance_a > links.instance_b) {
        std::swap(links.instance_a, links.instance_b);
        std::swap(links.link_a, links.link_b);
      }
      out.links.insert(links);
    }
    if (model_ != Model::kTriangles) return out;
    for (std::size_t t = 0; t < found_; ++t) {
      const TouchingTriangles& one = touching_[t];
      const Hit& hit = hits_[one.pair];
      InstanceTriangles pair = {
          index(hit.batch_a, hit.instance_a), first_[hit.batch_a.value - 1][one.leaf_a] + one.triangle_a,
          index(hit.batch_b, hit.instance_b), first_[hit.batch_b.value - 1][one.leaf_b] + one.triangle_b};
      if (pair.instance_a > pair.instance_b) {
        std::swap(pair.instance_a, pair.instance_b);
        std::swap(pair.triangle_a, pair.triangle_b);
      }
      out.triangles.push_back(pair);
    }
    return out;
  }

 private:
  void add_actor(std::uint32_t actor) {
    const SurfaceActor& of = world_.actors[actor];
    const bool is_of_hulls = model_ == Model::kHulls || model_ == Model::kLevel;
    scenes::Character body = is_of_hulls ? of.hulls : of.surface;
    if (model_ == Model::kStillBoxes)
      for (scenes::BodyLeaf& leaf : body.leaves) leaf.triangles.clear();
    if (model_ == Model::kStillBoxes) body.skin = {};
    const scenes::ArticulationStorage storage(body);
    BatchDesc batch;
    require(add_articulation(*engine_, storage.desc(), &batch.articulation), "a body");
    if (model_ == Model::kLevel) {
      LodDesc level;
      level.of = batch.articulation;
      level.kind = LodKind::kNodes;
      require(add_lod(*engine_, level, &batch.articulation), "a level");
    }
    std::vector<std::uint32_t>& numbers = number_.emplace_back();
    for (std::uint32_t i = 0; i < world_.instances.size(); ++i)
      if (world_.instances[i].actor == actor) numbers.push_back(i);
    batch.instance_count = static_cast<std::uint32_t>(numbers.size());
    BatchInput& input = inputs_.emplace_back();
    require(add_batch(*engine_, batch, &input.batch), "a batch");
    std::vector<std::uint32_t>& first = first_.emplace_back();
    std::uint32_t count = 0;
    for (const scenes::BodyLeaf& leaf : of.surface.leaves) {
      first.push_back(count);
      count += static_cast<std::uint32_t>(leaf.triangles.size() / 3);
    }
    poses_.resize(world_.frame_count());
    origins_.resize(world_.frame_count());
    for (std::uint32_t f = 0; f < world_.frame_count(); ++f) {
      std::vector<float>& poses = poses_[f].emplace_back();
      std::vector<double>& origins = origins_[f].emplace_back();
      for (const std::uint32_t i : numbers) {
        poses.insert(poses.end(), world_.poses(i, f), world_.poses(i, f) + 7 * of.surface.link_parents.size());
        const oracle::Vec3<double> at = world_.origin(i, f);
        origins.insert(origins.end(), at.v, at.v + 3);
      }
    }
  }

  const SurfaceWorld& world_;
  const Model model_;
  oracle::EnginePtr engine_;
  std::vector<BatchInput> inputs_;
  std::vector<PairRule> rules_;
  std::vector<std::vector<std::uint32_t>> number_, first_;  // by batch: of instances in the world, and of triangles
  std::vector<std::vector<std::vector<float>>> poses_;      // by frame and batch
  std::vector<std::vector<std::vector<double>>> origins_;
  FrameJob job_;
  std::vector<Hit> hits_;
  std::vector<TouchingTriangles> touching_;
  std::size_t found_ = 0;
};

// A set-up, and what was found of it over all frames.
struct SurfaceRow {
  std::string name, meaning;
  bool ours = false;         // it may miss nothing
  bool by_instance = false;  // it answers for instances as wholes
  bool names_triangles = false;
  std::function<void(std::uint32_t frame)> run;
  std::function<Answer()> answer;
  std::vector<double> seconds = {};  // per frame, of each round
  double judged_seconds = 0;         // per frame, of the frames before the judge
  // Whether frames before the judge are all that is timed.
  bool is_slow() const { return judged_seconds > kSlow; }
  std::uint64_t links = 0, false_links = 0, missed_links = 0;
  std::uint64_t triangles = 0, false_triangles = 0, missed_triangles = 0;
};

// How many of the first are not in the second.
template <class Sorted>
std::uint64_t count_beyond(const Sorted& some, const Sorted& others) {
  std::vector<typename Sorted::value_type> out;
  std::set_difference(some.begin(), some.end(), others.begin(), others.end(), std::back_inserter(out));
  return out.size();
}

// Links of a world's triangles that touch.
std::set<InstanceLinks> links_of(const SurfaceWorld& world, const std::vector<InstanceTriangles>& triangles) {
  std::vector<std::vector<std::uint32_t>> links;
  for (const SurfaceActor& actor : world.actors) links.push_back(links_of_triangles(actor.surface));
  std::set<InstanceLinks> out;
  for (const InstanceTriangles& pair : triangles)
    out.insert({pair.instance_a, links[world.instances[pair.instance_a].actor][pair.triangle_a], pair.instance_b,
                links[world.instances[pair.instance_b].actor][pair.triangle_b]});
  return out;
}

std::set<InstanceLinks> without_links(const std::set<InstanceLinks>& links) {
  std::set<InstanceLinks> out;
  for (const InstanceLinks& pair : links) out.insert({pair.instance_a, 0, pair.instance_b, 0});
  return out;
}

// near: what touches, and what is so little apart that it may be reported.
void count(SurfaceRow& row, const Answer& found, const Answer& truth, const Answer& near) {
  const auto links_for = [&row](const Answer& of) { return row.by_instance ? without_links(of.links) : of.links; };
  const std::set<InstanceLinks> links = links_for(found);
  row.links += links.size();
  row.false_links += count_beyond(links, links_for(near));
  row.missed_links += count_beyond(links_for(truth), links);
  if (!row.names_triangles) return;
  std::vector<InstanceTriangles> triangles = found.triangles;
  std::sort(triangles.begin(), triangles.end());
  row.triangles += triangles.size();
  row.false_triangles += count_beyond(triangles, near.triangles);
  row.missed_triangles += count_beyond(truth.triangles, triangles);
}

class SurfaceRun {
 public:
  SurfaceRun(const SurfaceWorld& world, Isa isa) : world_(world) {
    add_ours("level", "one box a character (LodKind::kNodes), for characters as wholes", isa, Model::kLevel);
    add_ours("boxes that do not grow", "boxes about triangles as the link with most of their weight moves them", isa,
             Model::kStillBoxes);
    add_ours("grown boxes", "boxes that hold the skin in every pose, exact = none", isa, Model::kGrownBoxes);
    add_ours("hulls", "a hull about the triangles of each link, exact = convex", isa, Model::kHulls);
    add_ours("surface", "links whose triangles touch, exact = surface", isa, Model::kSurface);
    add_ours("surface, triangles", "the same, then find_touching_triangles of these links", isa, Model::kTriangles);
    add_rival(own_tree(world, isa));
#ifdef CAB_WITH_EMBREE
    for (SurfaceRival& trees : embree_trees(world, isa)) add_rival(std::move(trees));
#endif
    add_rival(fcl_trees(world, isa));
  }

  void run(std::uint32_t rounds) {
    for (std::uint32_t f = 0; f < world_.frame_count(); ++f) {
      const JudgedSurfaces judged = judge_surfaces(world_, f);
      const Answer truth = {links_of(world_, judged.touching), judged.touching},
                   near = {links_of(world_, judged.near), judged.near};
      touching_links_ += truth.links.size();
      touching_triangles_ += truth.triangles.size();
      for (SurfaceRow& row : rows_) {
        const double start = processor_seconds();
        row.run(f);
        row.judged_seconds += (processor_seconds() - start) / world_.frame_count();
        count(row, row.answer(), truth, near);
      }
    }
    for (SurfaceRow& row : rows_)
      if (row.is_slow()) row.seconds = {row.judged_seconds};
    ProgressBar bar("rounds", rounds);
    for (std::uint32_t r = 0; r < rounds; ++r) {
      for (SurfaceRow& row : rows_) {
        if (row.is_slow()) continue;
        row.run(0);  // the turn before filled the caches with other data
        const double start = processor_seconds();
        for (std::uint32_t f = 0; f < world_.frame_count(); ++f) row.run(f);
        row.seconds.push_back((processor_seconds() - start) / world_.frame_count());
      }
      bar.advance(1);
    }
  }

  // Whether models of cab that hold the skin miss nothing, and the triangles that it names touch. A link that is
  // reported and false to the judge may be inside another skin.
  bool right() const {
    return std::none_of(rows_.begin(), rows_.end(), [](const SurfaceRow& row) {
      return row.ours && (row.missed_links > 0 || row.missed_triangles > 0 || row.false_triangles > 0);
    });
  }

  void print_head(Isa isa) const {
    std::cout << world_.instances.size() << " characters, " << world_.frame_count() << " frames; threads 1, ISA "
              << to_string(isa) << '\n';
    for (const SurfaceActor& actor : world_.actors)
      std::cout << actor.surface.name << ": " << links_of_triangles(actor.surface).size() << " triangles in "
                << actor.surface.leaves.size() << " leaves, " << actor.hulls.leaves.size() << " hulls\n";
    for (const SurfaceRow& row : rows_) std::cout << "  " << row.name << ": " << row.meaning << '\n';
  }

  Json print_table() const {
    Json json = {{"characters", world_.instances.size()}, {"frames", world_.frame_count()},
                 {"touching_links", touching_links_},     {"touching_triangles", touching_triangles_},
                 {"cab_version", CAB_VERSION_STRING},     {"runs", Json::array()}};
    TextTable table;
    table.add_row({"", "us per frame", "least", "most", "links", "false", "missed", "triangles", "false", "missed"});
    for (const SurfaceRow& row : rows_) {
      const Spread time = spread_of(row.seconds);
      const auto shown = [&row](std::uint64_t value) { return row.names_triangles ? std::to_string(value) : ""; };
      table.add_row({row.name, fixed(1e6 * time.median, 1), fixed(1e6 * time.least, 1), fixed(1e6 * time.most, 1),
                     std::to_string(row.links), std::to_string(row.false_links), std::to_string(row.missed_links),
                     shown(row.triangles), shown(row.false_triangles), shown(row.missed_triangles)});
      Json one = {{"setup", row.name},
                  {"links", row.links},
                  {"false_links", row.false_links},
                  {"missed_links", row.missed_links}};
      if (row.names_triangles)
        one.update({{"triangles", row.triangles},
                    {"false_triangles", row.false_triangles},
                    {"missed_triangles", row.missed_triangles}});
      add_spread(one, "seconds", time);
      json["runs"].push_back(std::move(one));
    }
    std::cout << '\n';
    table.print(std::cout);
    std::cout << "by the judge, over all frames: " << touching_links_ << " pairs of links, " << touching_triangles_
              << " pairs of triangles\n";
    return json;
  }

 private:
  void add_ours(const std::string& name, const std::string& meaning, Isa isa, Model model) {
    const auto engines = std::make_shared<Engines>(world_, isa, model);
    SurfaceRow& row = rows_.emplace_back();
    row.name = name;
    row.meaning = meaning;
    row.ours = model != Model::kStillBoxes && model != Model::kHulls;
    row.by_instance = model == Model::kLevel;
    row.names_triangles = model == Model::kTriangles;
    row.run = [engines](std::uint32_t frame) { engines->run(frame); };
    row.answer = [engines] { return engines->answer(); };
  }

  void add_rival(SurfaceRival rival) {
    SurfaceRow& row = rows_.emplace_back();
    row.name = rival.name;
    row.meaning = rival.meaning;
    row.names_triangles = true;
    const auto found = std::make_shared<std::vector<InstanceTriangles>>();
    row.run = [found, run = std::move(rival.run)](std::uint32_t frame) {
      found->clear();
      run(frame, *found);
    };
    row.answer = [found, this] { return Answer{links_of(world_, *found), *found}; };
  }

  const SurfaceWorld& world_;
  std::vector<SurfaceRow> rows_;
  std::uint64_t touching_links_ = 0, touching_triangles_ = 0;
};

SurfaceWorld load_world(const PeersOptions& options) {
  std::vector<SurfaceActor> actors;
  for (const std::string& file : options.surfaces)
    actors.push_back(load_surface_actor(file, options.robot.import.sandbox));
  if (actors.size() == 1) return make_surface_grid(std::move(actors[0]), options.surface_characters, options.apart);
  SurfaceWorld world;
  for (std::uint32_t a = 0; a < actors.size(); ++a) {
    world.instances.push_back({a, 0, {0, 0, 0}});
    if (actors[a].frame_count != actors[0].frame_count)
      throw std::runtime_error(options.surfaces[a] + ": has other frames than " + options.surfaces[0]);
  }
  world.actors = std::move(actors);
  return world;
}

}  // namespace

int surfaces_command(const PeersOptions& options) {
  check_outputs({{"--json", options.json_path}}, options.surfaces, [&options](const std::string& file) {
    return scenes::companion_files(file, options.robot.import.sandbox);
  });
  OutputFile json(options.json_path);
  const SurfaceWorld world = load_world(options);
  EngineDesc desc;
  desc.isa = options.isa;
  const Isa isa = engine_isa(*make_engine(desc));
  SurfaceRun run(world, isa);
  run.print_head(isa);
  run.run(options.rounds);
  write_json(json, run.print_table());
  if (!run.right()) std::cerr << "cab peers: surfaces or boxes of this engine miss what touches by the judge\n";
  return run.right() ? 0 : 1;
}

}  // namespace cab::perf
