#include "sdk/base/util/markup.hpp"

#include <doctest/doctest.h>

using namespace defrec;

TEST_CASE("what HTML and XML would read as markup is replaced") {
    CHECK(escaped("\"<a>\"") == "&quot;&lt;a&gt;&quot;");
    CHECK(escaped("<a b='c' d=\"e\">&") == "&lt;a b=&#39;c&#39; d=&quot;e&quot;&gt;&amp;");
}
