// The tests of cab::mpi: every rank runs all of them, with the same random numbers.
#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#include <mpi.h>

int main(int argument_count, char** arguments) {
  MPI_Init(&argument_count, &arguments);
  const int failed = doctest::Context(argument_count, arguments).run();
  // A failure of one rank is one of all, so that mpirun's result tells of it.
  int any = failed;
  MPI_Allreduce(&failed, &any, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
  MPI_Finalize();
  return any;
}
