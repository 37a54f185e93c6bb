// A row of unit boxes, 0.9 apart, of which each rank has ten: how many pairs touch, as rank 0 says it.
#include <cab/mpi.h>

#include <cstdint>
#include <cstdio>
#include <vector>

namespace {

int run(int rank, int ranks) {
  cab::mpi::DistributedEngine* engine = nullptr;
  if (!cab::mpi::create(MPI_COMM_WORLD, {}, &engine).ok()) return 1;
  const std::int32_t parent = -1;
  cab::Leaf leaf;
  leaf.box = {{0, 0, 0}, {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {.5f, .5f, .5f}};
  cab::ArticulationDesc box;
  box.link_parents = {&parent, 1};
  box.leaves = {&leaf, 1};
  cab::BatchDesc row;
  row.instance_count = static_cast<std::uint32_t>(10 * ranks);
  if (!cab::mpi::add_articulation(*engine, box, &row.articulation).ok()) return 1;
  cab::mpi::RankInput mine;
  if (!cab::mpi::add_batch(*engine, row, &mine.input.batch).ok()) return 1;

  std::vector<std::uint32_t> numbers;
  std::vector<float> poses;
  std::vector<double> origins;
  for (int i = 10 * rank; i < 10 * rank + 10; ++i) {
    numbers.push_back(static_cast<std::uint32_t>(i));
    poses.insert(poses.end(), {0, 0, 0, 1, 0, 0, 0});
    origins.insert(origins.end(), {.9 * i, 0, 0});
  }
  mine.numbers = numbers;
  mine.input.poses.data = poses.data();
  mine.input.origins = origins;
  const cab::PairRule rule = {mine.input.batch, mine.input.batch, cab::Pairing::kBetween};
  cab::mpi::DistributedJob job;
  job.inputs = {&mine, 1};
  job.rules = {&rule, 1};
  if (!cab::mpi::run_frame(*engine, job).ok()) return 1;
  unsigned long long own = job.hit_list.size, all = 0;
  MPI_Reduce(&own, &all, 1, MPI_UNSIGNED_LONG_LONG, MPI_SUM, 0, MPI_COMM_WORLD);
  if (rank == 0) std::printf("%llu pairs touch on %d ranks\n", all, ranks);
  cab::mpi::destroy(engine);
  return 0;
}

}  // namespace

int main(int argument_count, char** arguments) {
  MPI_Init(&argument_count, &arguments);
  int rank = 0, ranks = 1;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  MPI_Comm_size(MPI_COMM_WORLD, &ranks);
  const int result = run(rank, ranks);
  MPI_Finalize();
  return result;
}
