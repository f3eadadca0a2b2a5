// When a template is given up that the tracker captured by itself.
#include "sdk/tracking/monitors/template_trial.hpp"

#include <doctest/doctest.h>

using defrec::TemplateTrial;

namespace {

// After how many such frames the template is given up; 0: it is not.
int given_up_after(TemplateTrial& trial, bool is_found, uint32_t features) {
    for (int frame = 1; frame <= 100; ++frame)
        if (trial.add_frame(is_found, features)) return frame;
    return 0;
}

}  // namespace

TEST_CASE("row 150: a blurred template is given up once sharp frames do not find it") {
    TemplateTrial trial;
    trial.begin(60);
    CHECK(given_up_after(trial, true, 50) == 0);
    CHECK(given_up_after(trial, false, 50) == 0);
    CHECK(given_up_after(trial, false, 700) == 3);
    CHECK(given_up_after(trial, false, 700) == 0);
}

TEST_CASE("row 150: a template that was never found is given up after three good frames") {
    TemplateTrial trial;
    trial.begin(700);
    CHECK(given_up_after(trial, false, 100) == 0);  // blurred
    CHECK(given_up_after(trial, false, 650) == 3);
}

TEST_CASE("frames that may show noise alone do not judge a template") {
    TemplateTrial trial;
    trial.begin(16, 384);
    CHECK(given_up_after(trial, false, 380) == 0);
    CHECK(given_up_after(trial, false, 390) == 3);
}

TEST_CASE("a template that was found is kept while its tissue is out of sight") {
    TemplateTrial trial;
    trial.begin(700);
    CHECK_FALSE(trial.add_frame(true, 700));
    CHECK(given_up_after(trial, false, 768) == 0);
}

TEST_CASE("a poor template that sharp frames have found is kept") {
    TemplateTrial trial;
    trial.begin(250);
    CHECK_FALSE(trial.add_frame(true, 700));
    CHECK(given_up_after(trial, false, 700) == 3);
    trial.begin(250);
    CHECK(given_up_after(trial, true, 700) == 0);
    CHECK(given_up_after(trial, false, 700) == 0);
}

TEST_CASE("a template that the application chose is never given up") {
    TemplateTrial trial;
    CHECK(given_up_after(trial, false, 700) == 0);
    trial.begin(60);
    trial.end();
    CHECK(given_up_after(trial, false, 700) == 0);
}
