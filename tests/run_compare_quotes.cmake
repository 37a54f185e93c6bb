cmake_minimum_required(VERSION 3.25)
# Proves that compare_quotes.cmake in ROOT finds each difference between a document and what it quotes, in full or in
# part, and unmatched marks. The documents are made in WORK.
set(whole "int whole() { return 1; }\n")
string(CONCAT part "#include <a>\n  // quote\n  if (a) {\n    b[0];\n  }\n  // end quote\nc;\n"
  "// quote\nd = \"\\n;\";\n// end quote\n")
set(lines "if (a) {\n  b[0];\n}\n// ...\nd = \"\\n;\";\n")
string(CONCAT document "# Page\n\n<!-- tests/whole.cpp -->\n```cpp\n${whole}```\n\n"
  "<!-- tests/part.cpp, in part -->\n```cpp\n${lines}```\n")

# Runs the comparison of `document` with the two sources, and complains unless it ends as `expected`, 0 or 1.
function(compare expected document whole part)
  file(REMOVE_RECURSE ${WORK})
  file(WRITE ${WORK}/page.md "${document}")
  file(WRITE ${WORK}/tests/whole.cpp "${whole}")
  file(WRITE ${WORK}/tests/part.cpp "${part}")
  execute_process(COMMAND ${CMAKE_COMMAND} -D ROOT=${WORK} -D DOCUMENT=page.md
    "-DSOURCES=tests/whole.cpp;tests/part.cpp" -P ${ROOT}/tests/compare_quotes.cmake
    RESULT_VARIABLE result OUTPUT_VARIABLE output ERROR_VARIABLE output)
  if(NOT result EQUAL expected)
    message(SEND_ERROR "compare_quotes.cmake ends with ${result}, not ${expected}, on\n${document}\nand\n${part}\n"
      "${output}")
  endif()
endfunction()

compare(0 "${document}" "${whole}" "${part}")

# The comparison fails when `from` is `to` instead in one of the three texts: document, whole or part.
function(find_fault where from to)
  string(FIND "${${where}}" "${from}" at)
  if(at EQUAL -1)
    message(SEND_ERROR "${where} has no ${from}")
  endif()
  string(REPLACE "${from}" "${to}" ${where} "${${where}}")
  compare(1 "${document}" "${whole}" "${part}")
endfunction()

find_fault(document "return 1" "return 2")
find_fault(whole "return 1" "return 2")
find_fault(part "if (a)" "if (b)")
find_fault(document "  b[0];" "b[0];")
find_fault(document "  b[0];\n" "")
find_fault(document "// ...\n" "")
find_fault(document ", in part" "")
find_fault(document "<!-- tests/whole.cpp -->" "<!-- tests/other.cpp -->")
find_fault(document "# Page\n" "<!-- tests/other.cpp -->\n")
find_fault(document "# Page\n" "<!-- tests/whole.cpp, in part -->\n")
find_fault(part "    b[0];\n" "    b[0];\n    more;\n")
find_fault(part "  // end quote\n" "")
find_fault(part "  // end quote\n" "// end quote\n")
find_fault(part "  // quote\n" "")
find_fault(part "if (a) {\n" "if (a) {\n    // quote\n")
