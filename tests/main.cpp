#define DOCTEST_CONFIG_IMPLEMENT
#include <doctest/doctest.h>

#ifdef _WIN32
#include <fcntl.h>
#include <io.h>
#endif

int main(int argument_count, char** arguments) {
#ifdef _WIN32
  _setmode(1, _O_BINARY);  // the list of test cases, which CTest's script reads, has the ends of lines that C has
#endif
  return doctest::Context(argument_count, arguments).run();
}
