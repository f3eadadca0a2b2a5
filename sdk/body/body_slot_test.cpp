// When a template's body is computed, by whom, and which one serves meanwhile.
#include "sdk/body/body_slot.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <future>
#include <string>
#include <thread>
#include <vector>

#include "sdk/base/os/services.hpp"
#include "sdk/base/util/error.hpp"
#include "sdk/body/test_body.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

constexpr uint64_t kForEver = UINT64_MAX;

std::shared_ptr<const Services> make_services() {
    defrec_context_desc desc{};
    desc.threads = 1;
    return std::make_shared<const Services>(desc);
}

// Its body is computed in a moment. More rows, so that bodies differ.
TestSurface tiny_surface(int rows = 1) {
    TestSurface surface;
    for (int row = 0; row < rows; ++row)
        for (const double x : {0.0, 12.0}) surface.add({x, 12.0 * row, kSurfaceZ}, {0, 0, -1});
    return surface;
}

// Holds the background thread for as long as it lives.
class BusyThread {
  public:
    explicit BusyThread(const Services& services) {
        services.background().add([end = end_.get_future().share(), &began = began_] {
            began = true;
            end.wait();
        });
        while (!began_) std::this_thread::yield();
    }
    ~BusyThread() { end_.set_value(); }
    BusyThread(const BusyThread&) = delete;
    BusyThread& operator=(const BusyThread&) = delete;

  private:
    std::promise<void> end_;
    std::atomic<bool> began_{false};
};

// Waits until the background thread has done what it was given so far.
void finish_background(const Services& services) {
    std::promise<void> done;
    services.background().add([&] { done.set_value(); });
    done.get_future().wait();
}

size_t vertices_of(const BodySlot& slot) {
    const std::shared_ptr<const Body> body = slot.body();
    return body != nullptr ? body->vertices() : 0;
}

}  // namespace

TEST_CASE("a body is pending from its start, then ready, and stays the same") {
    const auto services = make_services();
    const TestSurface surface = tiny_surface();
    BodySlot slot(services);
    CHECK(slot.state() == DEFREC_BODY_STATE_NONE);
    CHECK(slot.body() == nullptr);
    CHECK(slot.description() == nullptr);
    {
        const BusyThread busy(*services);
        slot.start(surface.view());
        CHECK(slot.state() == DEFREC_BODY_STATE_PENDING);
        CHECK(slot.body() == nullptr);
        CHECK(slot.wait(surface.view(), 0) == DEFREC_TIMEOUT);
        CHECK(slot.wait(surface.view(), 1000) == DEFREC_TIMEOUT);
    }
    CHECK(slot.wait(surface.view(), kForEver) == DEFREC_OK);
    CHECK(slot.state() == DEFREC_BODY_STATE_READY);
    const std::shared_ptr<const Body> body = slot.body();
    REQUIRE(body != nullptr);
    slot.start(surface.view());
    CHECK(slot.wait(surface.view(), 0) == DEFREC_OK);
    CHECK(slot.body() == body);
}

TEST_CASE("who waits for a body that nobody has started starts it") {
    const auto services = make_services();
    BodySlot slot(services);
    CHECK(slot.wait(tiny_surface().view(), kForEver) == DEFREC_OK);
    CHECK(slot.state() == DEFREC_BODY_STATE_READY);
}

TEST_CASE("a surface is copied: it may be gone before the body is made") {
    const auto services = make_services();
    BodySlot slot(services);
    {
        const BusyThread busy(*services);
        const TestSurface surface = tiny_surface(2);
        slot.start(surface.view());
    }
    finish_background(*services);
    CHECK(vertices_of(slot) == 4);
}

TEST_CASE("where no body can be made of a surface, who waits is told, and it has none") {
    const auto services = make_services();
    TestSurface surface = tiny_surface();
    surface.pieces = 2;
    BodySlot slot(services);
    slot.start(surface.view());
    for (int i = 0; i < 2; ++i) {
        defrec_status status = DEFREC_OK;
        std::string words;
        try {
            slot.wait(surface.view(), kForEver);
        } catch (const Error& error) {
            status = error.status();
            words = error.what();
        }
        CHECK(status == DEFREC_ERROR_UNSUPPORTED);
        CHECK(words.find("no body") != std::string::npos);
    }
    CHECK(slot.state() == DEFREC_BODY_STATE_NONE);
    CHECK(slot.body() == nullptr);
}

TEST_CASE("a body that is described anew is another one, the old one serves meanwhile") {
    const auto services = make_services();
    const TestSurface surface = tiny_surface();
    BodySlot slot(services);
    CHECK(slot.wait(surface.view(), kForEver) == DEFREC_OK);
    const std::shared_ptr<const Body> old = slot.body();
    auto stiff = std::make_shared<BodyDescription>();
    stiff->poisson_ratio = 0.2;
    auto soft = std::make_shared<BodyDescription>();
    {
        const BusyThread busy(*services);
        // The second one before the first is begun.
        slot.describe(stiff, surface.view());
        CHECK(slot.state() == DEFREC_BODY_STATE_PENDING);
        CHECK(slot.body() == old);
        slot.describe(soft, surface.view());
        CHECK(slot.description() == soft);
        CHECK(slot.state() == DEFREC_BODY_STATE_PENDING);
        CHECK(slot.body() == old);
        CHECK(slot.wait(surface.view(), 0) == DEFREC_TIMEOUT);
        CHECK(slot.body() == old);
    }
    CHECK(slot.wait(surface.view(), kForEver) == DEFREC_OK);
    CHECK(slot.body() != nullptr);
    CHECK(slot.body() != old);
    CHECK(slot.state() == DEFREC_BODY_STATE_READY);
    slot.describe(nullptr, surface.view());
    CHECK(slot.wait(surface.view(), kForEver) == DEFREC_OK);
    CHECK(slot.description() == nullptr);
}

TEST_CASE("a description that is recalled counts from when the body is computed") {
    const auto services = make_services();
    const auto description = std::make_shared<BodyDescription>();
    BodySlot slot(services);
    slot.recall(description);
    CHECK(slot.description() == description);
    CHECK(slot.state() == DEFREC_BODY_STATE_NONE);
    CHECK(slot.wait(tiny_surface().view(), kForEver) == DEFREC_OK);
}

TEST_CASE("the body of the surface before serves until there is one, described the same way") {
    const auto services = make_services();
    const auto description = std::make_shared<BodyDescription>();
    const auto first = std::make_shared<BodySlot>(services);
    first->recall(description);
    CHECK(first->wait(tiny_surface(1).view(), kForEver) == DEFREC_OK);
    BodySlot second(first);
    CHECK(second.description() == description);
    CHECK(second.state() == DEFREC_BODY_STATE_NONE);
    CHECK(second.body() == first->body());
    {
        const BusyThread busy(*services);
        second.start(tiny_surface(2).view());
        CHECK(second.state() == DEFREC_BODY_STATE_PENDING);
        CHECK(vertices_of(second) == 2);
    }
    CHECK(second.wait(tiny_surface(2).view(), kForEver) == DEFREC_OK);
    CHECK(vertices_of(second) == 4);
    CHECK(vertices_of(*first) == 2);
}

TEST_CASE("of many surfaces that follow one another those that wait are not computed") {
    constexpr int kCount = 12;
    const auto services = make_services();
    std::vector<std::shared_ptr<BodySlot>> slots{std::make_shared<BodySlot>(services)};
    CHECK(slots[0]->wait(tiny_surface(1).view(), kForEver) == DEFREC_OK);
    {
        const BusyThread busy(*services);
        for (int i = 1; i < kCount; ++i) {
            slots.push_back(std::make_shared<BodySlot>(slots.back()));
            slots.back()->start(tiny_surface(1 + i).view());
            CHECK(vertices_of(*slots.back()) == 2);
        }
    }
    finish_background(*services);
    CHECK(vertices_of(*slots.back()) == 2 * kCount);
    for (int i = 1; i + 1 < kCount; ++i) {
        CHECK(slots[static_cast<size_t>(i)]->state() == DEFREC_BODY_STATE_NONE);
        CHECK(vertices_of(*slots[static_cast<size_t>(i)]) == 2);
    }
    // Who still wants one of them gets it.
    CHECK(slots[3]->wait(tiny_surface(4).view(), kForEver) == DEFREC_OK);
    CHECK(vertices_of(*slots[3]) == 8);
}

TEST_CASE("a slot whose body is ready keeps none of those before alive") {
    const auto services = make_services();
    auto first = std::make_shared<BodySlot>(services);
    CHECK(first->wait(tiny_surface(1).view(), kForEver) == DEFREC_OK);
    const std::weak_ptr<const BodySlot> before = first;
    const std::weak_ptr<const Body> body = first->body();
    BodySlot second(first);
    first.reset();
    CHECK(vertices_of(second) == 2);
    CHECK(second.wait(tiny_surface(2).view(), kForEver) == DEFREC_OK);
    CHECK(vertices_of(second) == 4);
    CHECK(before.expired());
    CHECK(body.expired());
}

TEST_CASE("what is said of a surface counts for what it became, and for what it came from") {
    const auto services = make_services();
    const TestSurface surface = tiny_surface();
    const auto first = std::make_shared<BodySlot>(services);
    const auto grown = std::make_shared<BodySlot>(first);
    const auto described = [](double ratio) {
        auto description = std::make_shared<BodyDescription>();
        description->poisson_ratio = ratio;
        return description;
    };
    const auto one = described(0.3), other = described(0.4);
    first->describe(one, surface.view());
    CHECK(grown->description() == nullptr);
    grown->follow_lineage(surface.view());
    CHECK(grown->description() == one);
    CHECK(grown->wait(surface.view(), kForEver) == DEFREC_OK);
    const std::shared_ptr<const Body> body = grown->body();
    grown->follow_lineage(surface.view());
    CHECK(grown->body() == body);
    grown->describe(other, surface.view());
    first->follow_lineage(surface.view());
    CHECK(first->description() == other);
}

TEST_CASE("bodies that no longer serve are given up though nobody asks for points") {
    const auto services = make_services();
    const TestSurface surface = tiny_surface();
    auto first = std::make_shared<BodySlot>(services);
    CHECK(first->wait(surface.view(), kForEver) == DEFREC_OK);
    const std::weak_ptr<const Body> old = first->body();
    const auto grown = std::make_shared<BodySlot>(first);
    first.reset();
    CHECK_FALSE(old.expired());
    CHECK(grown->wait(surface.view(), kForEver) == DEFREC_OK);
    CHECK(grown->state() == DEFREC_BODY_STATE_READY);
    CHECK(old.expired());
    const std::weak_ptr<const Body> undescribed = grown->body();
    grown->describe(nullptr, surface.view());
    CHECK_FALSE(undescribed.expired());
    CHECK(grown->wait(surface.view(), kForEver) == DEFREC_OK);
    CHECK(grown->state() == DEFREC_BODY_STATE_READY);
    CHECK(undescribed.expired());
}

TEST_CASE("where the services are gone who waits computes the body") {
    auto services = make_services();
    BodySlot fresh(services), queued(services);
    auto busy = std::make_unique<BusyThread>(*services);
    queued.start(tiny_surface(2).view());
    CHECK(queued.state() == DEFREC_BODY_STATE_PENDING);
    // The thread ends after what it does now, and what is queued is dropped.
    std::thread last([&] { services.reset(); });
    busy.reset();
    last.join();
    fresh.start(tiny_surface().view());
    CHECK(fresh.body() == nullptr);
    CHECK(fresh.wait(tiny_surface().view(), kForEver) == DEFREC_OK);
    CHECK(fresh.state() == DEFREC_BODY_STATE_READY);
    CHECK(queued.wait(tiny_surface(2).view(), kForEver) == DEFREC_OK);
    CHECK(vertices_of(queued) == 4);
}

TEST_CASE("several threads wait for one body, and ask while it is described anew") {
    const auto services = make_services();
    const TestSurface surface = tiny_surface(2);
    BodySlot slot(services);
    std::atomic<int> ready{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i)
        threads.emplace_back([&, i] {
            for (int round = 0; round < 5; ++round) {
                if (i == 0) slot.describe(std::make_shared<BodyDescription>(), surface.view());
                if (i == 1) slot.start(surface.view());
                ready += slot.wait(surface.view(), kForEver) == DEFREC_OK;
                slot.state();
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(ready == 20);
    CHECK(vertices_of(slot) == 4);
}

TEST_CASE("a slot may go while its body is computed") {
    const auto services = make_services();
    const TestSurface surface = make_surface();
    for (int i = 0; i < 4; ++i) {
        BodySlot slot(services);
        slot.start(surface.view());
        if (i % 2 != 0) std::this_thread::yield();
    }
    finish_background(*services);
}
