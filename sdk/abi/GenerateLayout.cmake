# Writes a C program that prints the layout of every struct and the value of every enumerator of the public headers.
# cmake -DHEADERS=a.h,b.h -DINCLUDE=defrec_plugin.h -DOUT=layout.c -P this
cmake_minimum_required(VERSION 3.25)
string(REPLACE "," ";" headers "${HEADERS}")
set(lines "")
foreach(header IN LISTS headers)
  file(READ "${header}" text)
  # Neither semicolons nor brackets survive in CMake's lists.
  string(REGEX REPLACE "/\\*([^*]|\\*+[^*/])*\\*+/" "" text "${text}")
  string(REGEX REPLACE "\\[[^]]*\\]" "" text "${text}")
  string(REPLACE ";" "@" text "${text}")
  string(REGEX REPLACE "[ \t\r\n]+" " " text "${text}")

  string(REGEX MATCHALL "typedef struct [a-z_0-9]+ { [^}]*} [a-z_0-9]+@" structs "${text}")
  foreach(struct IN LISTS structs)
    string(REGEX MATCH "^typedef struct ([a-z_0-9]+) { ([^}]*)}" ignored "${struct}")
    set(name "${CMAKE_MATCH_1}")
    set(body "${CMAKE_MATCH_2}")
    if(NOT body MATCHES "struct_size")
      string(APPEND lines "    SIZE(${name});\n")
    endif()
    string(REPLACE "@" ";" declarations "${body}")
    foreach(declaration IN LISTS declarations)
      if(declaration MATCHES "\\(DEFREC_CALL \\*([a-z_0-9]+)\\)")
        string(APPEND lines "    FIELD(${name}, ${CMAKE_MATCH_1});\n")
        continue()
      endif()
      string(REPLACE "," ";" declarators "${declaration}")
      foreach(declarator IN LISTS declarators)
        if(declarator MATCHES "([A-Za-z_0-9]+) *$")
          string(APPEND lines "    FIELD(${name}, ${CMAKE_MATCH_1});\n")
        endif()
      endforeach()
    endforeach()
  endforeach()

  string(REGEX MATCHALL "enum { [^}]*}" enums "${text}")
  foreach(enum IN LISTS enums)
    string(REGEX MATCHALL "DEFREC_[A-Z_0-9]+ *=" names "${enum}")
    foreach(name IN LISTS names)
      string(REGEX MATCH "DEFREC_[A-Z_0-9]+" name "${name}")
      string(APPEND lines "    VALUE(${name});\n")
    endforeach()
  endforeach()
endforeach()
file(WRITE "${OUT}" "/* Made by GenerateLayout.cmake. */
#include <stdio.h>
#include \"${INCLUDE}\"
#define SIZE(s) printf(\"%s: %lu bytes\\n\", #s, (unsigned long)sizeof(s))
#define FIELD(s, f) printf(\"%s.%s: %lu at %lu\\n\", #s, #f, (unsigned long)sizeof(((s *)0)->f), (unsigned long)offsetof(s, f))
#define VALUE(e) printf(\"%s = %ld\\n\", #e, (long)e)
int main(void) {
${lines}    return 0;
}
")
