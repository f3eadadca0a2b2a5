// For the tests of what examines a plugin's library.
#pragma once
#include <doctest/doctest.h>

#include <string>

#include "sdk/base/util/error.hpp"

namespace defrec::test {

// Why a check refuses; "" where it does not.
template <class Check>
std::string refusal_of(Check check) {
    try {
        check();
    } catch (const Error& error) {
        CHECK(error.status() == DEFREC_ERROR_PLUGIN);
        return error.what();
    }
    return "";
}

inline bool contains(const std::string& text, const char* part) {
    return text.find(part) != std::string::npos;
}

}  // namespace defrec::test
