// For tests: that a message says something.
#pragma once

#include <doctest/doctest.h>

#include <string>

#define CHECK_SAYS(message, part) \
    CHECK_MESSAGE((message).find(part) != std::string::npos, (message))
