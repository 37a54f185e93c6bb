cmake_minimum_required(VERSION 3.25)
# Fails unless DOCUMENT quotes each of SOURCES in full, letter for letter. Both are paths from ROOT. LANGUAGE is what the
# quotes are marked with; default: cpp.
if(NOT LANGUAGE)
  set(LANGUAGE cpp)
endif()
file(READ ${ROOT}/${DOCUMENT} document)
foreach(source IN LISTS SOURCES)
  file(READ ${ROOT}/${source} program)
  string(FIND "${document}" "<!-- ${source} -->\n```${LANGUAGE}\n${program}```\n" at)
  if(at EQUAL -1)
    message(SEND_ERROR "the quote of ${source} in ${DOCUMENT} differs from the source: copy the one over the other, "
      "between the line <!-- ${source} --> with ```${LANGUAGE} below it and the closing ```")
  endif()
endforeach()
