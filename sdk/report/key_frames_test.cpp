// Which pictures the report keeps.
#include "sdk/report/key_frames.hpp"

#include <doctest/doctest.h>

#include <functional>
#include <set>
#include <string>

using defrec::cli::KeyFrame;
using defrec::cli::KeyFrames;

namespace {

/// Offers frames 0..count-1; returns how many pictures were asked for.
int offer(KeyFrames& pictures, int count, const std::function<std::string(int)>& state) {
    int taken = 0;
    for (int i = 0; i < count; ++i) {
        if (!pictures.wants(i, state(i))) continue;
        KeyFrame picture;
        picture.frame = i;
        picture.state = state(i);
        pictures.add(std::move(picture));
        ++taken;
    }
    return taken;
}

}  // namespace

TEST_CASE("every one of a few state changes is kept, beside evenly spread frames") {
    KeyFrames pictures;
    offer(pictures, 1000, [](int i) {
        return i < 501 ? "tracking" : i < 517 ? "lost" : "tracking";
    });
    std::set<std::int64_t> changed, all;
    for (const KeyFrame& picture : pictures.sorted()) {
        all.insert(picture.frame);
        if (picture.state_changed) changed.insert(picture.frame);
    }
    CHECK(changed == std::set<std::int64_t>{501, 517});
    CHECK(all.size() == pictures.sorted().size());
    CHECK(*all.begin() == 0);
    CHECK(*all.rbegin() > 700);
}

TEST_CASE("a flickering state does not fill the report nor cost a picture for each frame") {
    KeyFrames pictures;
    const int taken =
        offer(pictures, 10'000, [](int i) { return i % 2 ? "tracking" : "degraded"; });
    CHECK(pictures.sorted().size() <= KeyFrames::kEven + KeyFrames::kChanges);
    CHECK(taken < 200);
}
