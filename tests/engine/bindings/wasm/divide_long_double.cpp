// The division of long double for the judges of tests: that of Emscripten 3.1.6 gives 2 for 1 / (1 - 2^-113), and twice
// the quotient wherever it is rounded up to a power of two. The library has no long double.
#include <cmath>

extern "C" long double __divtf3(long double a, long double b) {
  if (!(std::isfinite(a) && std::isfinite(b)) || b == 0) {
    // Special values are those of double.
    const auto kind = [](long double x) {
      return std::isfinite(x) && x != 0 ? std::copysign(1.0, double(x)) : double(x);
    };
    return kind(a) / kind(b);
  }
  int exponent_a, exponent_b;
  const long double x = std::frexp(a, &exponent_a), y = std::frexp(b, &exponent_b);
  // Each step of Newton's method for 1 / y doubles the number of right bits; 53 are right at first.
  long double inverse = 1 / static_cast<double>(y);
  for (int step = 0; step < 2; ++step) inverse += inverse * (1 - y * inverse);
  long double quotient = x * inverse;
  quotient += inverse * (x - y * quotient);
  return std::ldexp(quotient, exponent_a - exponent_b);
}
