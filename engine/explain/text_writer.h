// Text in a caller's buffer, as much of it as fits.
#pragma once

#include "layout/compiler.h"

#include <cab/span.h>

#include <algorithm>
#include <cstdarg>
#include <cstdio>

namespace cab {

class TextWriter {
 public:
  // A text without data has no room, whatever its size.
  explicit TextWriter(Span<char> text) : text_(text.data == nullptr ? Span<char>() : text) {
    if (!text_.empty()) text_[0] = 0;
  }

  // Adds formatted text, as printf does.
  void add(const char* format, ...) CAB_PRINTF(2, 3);

  // Characters of the whole text, without the 0 at its end.
  std::size_t length() const { return length_; }

 private:
  Span<char> text_;
  std::size_t length_ = 0;
};

inline void TextWriter::add(const char* format, ...) {
  const std::size_t at = std::min(length_, text_.size);
  std::va_list values;
  va_start(values, format);
  const int added = std::vsnprintf(text_.data + at, text_.size - at, format, values);
  va_end(values);
  if (added > 0) length_ += static_cast<std::size_t>(added);
}

}  // namespace cab
