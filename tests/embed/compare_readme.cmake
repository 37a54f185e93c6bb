cmake_minimum_required(VERSION 3.25)
# Fails unless the C++ example of the document README is tests/embed/main.cpp, letter for letter.
file(READ ${README} readme)
file(READ ${EXAMPLE} example)
string(FIND "${readme}" "<!-- tests/embed/main.cpp -->\n```cpp\n${example}```\n" at)
if(at EQUAL -1)
  message(FATAL_ERROR "the example in ${README} differs from tests/embed/main.cpp: copy the one over the other, "
    "between the line <!-- tests/embed/main.cpp --> with ```cpp below it and the closing ```")
endif()
