# Writes a header with the text of a file. cmake -DTEXT= -DHEADER= -DNAME= -P this
file(READ "${TEXT}" text)
file(WRITE "${HEADER}"
     "// Generated from ${NAME}'s file.
#pragma once
namespace defrec::conformance {
inline constexpr char ${NAME}[] = R\"embedded(${text})embedded\";
}
")
