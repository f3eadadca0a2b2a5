// The relay over the reference: what it hands on, what it counts, how it fails and dawdles.
#include <doctest/doctest.h>

#include "conformance/cases/stress/relayed.hpp"
#include "conformance/cases/stress/stress.hpp"
#include "sdk/testing/test_files.hpp"

using namespace defrec::conformance;

namespace {

struct Relayed {
    explicit Relayed(RelayPlan plan = {}) : plugin(find_backend("reference"), "") {
        plan.counts = &counts;
        context = open_relayed_context(plugin, plan);
    }
    defrec_status rectify() {
        defrec_rectify_params params;
        DEFREC_INIT(&params);
        params.format = DEFREC_FORMAT_GRAY8;
        params.source_width = 8;
        params.source_height = 4;
        std::vector<uint8_t> source(32, 7), gray(32), mask(32);
        defrec_stage stage = nullptr;
        defrec_status status =
            defrec_stage_create(context.get(), "reference", DEFREC_STAGE_RECTIFY, &params, &stage);
        const defrec_const_buffer in{source.data(), source.size()};
        const defrec_buffer out[] = {{gray.data(), gray.size()}, {mask.data(), mask.size()}};
        if (status == DEFREC_OK) status = defrec_stage_run(stage, &in, 1, out, 2);
        if (status == DEFREC_OK) CHECK(gray == source);
        defrec_stage_destroy(stage);
        return status;
    }

    Plugin plugin;
    RelayCounts counts;
    ContextHandle context;
};

// A session with a plugin of sdk/plugin/test_plugins behind the relay.
struct RelayedStub {
    explicit RelayedStub(const char* name, RelayPlan plan = {})
        : target(find_plugin(defrec::test::stub_folder(name).string()), "") {
        plan.counts = &counts;
        arm_relay(target, plan);
        session = std::make_unique<Session>(relay);
    }
    const defrec_plugin& table() const { return session->table(); }

    RelayCounts counts;
    Plugin target, relay{find_plugin(relay_manifest()), "stub"};
    std::unique_ptr<Session> session;
};

}  // namespace

TEST_CASE("the relay hands on, and knows what is alive") {
    Relayed relayed;
    CHECK(relayed.counts.instances == 1);
    CHECK(relayed.rectify() == DEFREC_OK);
    CHECK(relayed.counts.failures == 0);
    CHECK(relayed.counts.stages == 0);
    relayed.context.reset();
    CHECK(relayed.counts.all_gone());
}

TEST_CASE("the relay fails at the nth call of a kind, once") {
    RelayPlan plan;
    plan.failing = kRelayEnqueue;
    plan.fail_at = 2;
    plan.status = DEFREC_ERROR_OUT_OF_MEMORY;
    Relayed relayed(plan);
    CHECK(relayed.rectify() == DEFREC_OK);
    CHECK(relayed.rectify() == DEFREC_ERROR_OUT_OF_MEMORY);
    CHECK(std::string(defrec_last_error()).find("told to fail") != std::string::npos);
    CHECK(relayed.rectify() == DEFREC_OK);
    CHECK(relayed.counts.calls == 3);
    CHECK(relayed.counts.failures == 1);
}

TEST_CASE("a lost device stays lost, and the relay sees who calls it all the same") {
    Plugin plugin(find_backend("reference"), "");
    RelayCounts counts;
    RelayPlan plan;
    plan.counts = &counts;
    plan.failing = kRelaySignal;
    plan.fail_at = 1;
    plan.status = DEFREC_ERROR_DEVICE_LOST;
    arm_relay(plugin, plan);
    const Plugin relay(find_plugin(relay_manifest()), "reference");
    {
        Session session(relay);
        Queue queue(session);
        CHECK_THROWS(queue.signal());
        CHECK(counts.after_loss == 0);
        CHECK_THROWS(queue.signal());
        CHECK(counts.after_loss == 1);
    }
    CHECK(counts.all_gone());
}

TEST_CASE("a slow device: a point is not reached before its time, and then it is") {
    Plugin plugin(find_backend("reference"), "");
    RelayCounts counts;
    RelayPlan plan;
    plan.counts = &counts;
    plan.delay_ns = 50'000'000;
    plan.failing = kRelayWait;
    arm_relay(plugin, plan);
    const Plugin relay(find_plugin(relay_manifest()), "reference");
    const Session session(relay);
    Queue queue(session);
    const uint64_t point = queue.signal();
    CHECK_FALSE(queue.wait(point, 0));
    CHECK_FALSE(queue.wait(point, 1'000'000));
    CHECK(queue.wait(point, UINT64_MAX));
    CHECK(queue.wait(point, 0));
    CHECK(counts.calls == 1);  // the one without limit
}

TEST_CASE("optional functions: the relay has them where the plugin has them, and hands them on") {
    const RelayedStub without("good");
    CHECK_FALSE(DEFREC_HAS(&without.table(), host_alloc));
    CHECK_FALSE(DEFREC_HAS(&without.table(), host_free));
    CHECK_FALSE(DEFREC_HAS(&without.table(), write_in_place));
    CHECK_FALSE(DEFREC_HAS(&without.table(), buffer_import));
    RelayPlan plan;
    plan.failing = kRelayCreate | kRelayTransfer;
    plan.fail_at = 9;
    plan.status = DEFREC_ERROR_OUT_OF_MEMORY;
    RelayedStub relayed("host_memory", plan);
    const defrec_plugin& table = relayed.table();
    defrec_pdevice* device = relayed.session->device();
    {
        void *from = nullptr, *to = nullptr;
        REQUIRE(table.host_alloc(device, 8, &from) == DEFREC_OK);
        REQUIRE(table.host_alloc(device, 8, &to) == DEFREC_OK);
        CHECK(relayed.counts.host_memories == 2);
        uint8_t bytes[8] = {};
        defrec_pbuffer* imported = nullptr;
        REQUIRE(table.buffer_import(device, DEFREC_MEMORY_HOST, bytes, sizeof bytes, &imported) ==
                DEFREC_OK);
        CHECK(relayed.counts.buffers == 1);
        defrec_pqueue* queue = nullptr;
        REQUIRE(table.queue_create(device, &queue) == DEFREC_OK);
        CHECK(table.write_in_place(queue, imported, 0, from, 8) == DEFREC_OK);
        static_cast<uint8_t*>(from)[7] = 9;
        CHECK(table.read(queue, imported, 0, to, 8) == DEFREC_OK);
        CHECK(static_cast<uint8_t*>(to)[7] == 9);
        CHECK(bytes[7] == 9);
        CHECK(table.buffer_import(device, DEFREC_MEMORY_CUDA, bytes, sizeof bytes, &imported) ==
              DEFREC_ERROR_UNSUPPORTED);
        CHECK(relayed.counts.calls == 7);
        CHECK(relayed.counts.failures == 0);
        CHECK(table.write_in_place(queue, imported, 0, from, 8) == DEFREC_OK);
        CHECK(table.host_alloc(device, 8, &to) == DEFREC_ERROR_OUT_OF_MEMORY);
        CHECK(relayed.counts.failures == 1);
        table.buffer_destroy(imported);
        table.queue_destroy(queue);
        table.host_free(device, from);
        table.host_free(device, to);
    }
    CHECK(relayed.counts.host_memories == 0);
    relayed.session.reset();
    CHECK(relayed.counts.all_gone());
}

TEST_CASE("unarmed, the relay refuses") {
    const Plugin relay(find_plugin(relay_manifest()), "");
    CHECK_THROWS(Instance(relay));
}

TEST_CASE("numbers spread over a range") {
    CHECK(spread_over(0, 5).empty());
    CHECK(spread_over(1, 5) == std::vector<uint64_t>{1});
    CHECK(spread_over(3, 5) == std::vector<uint64_t>{1, 2, 3});
    CHECK(spread_over(9, 3) == std::vector<uint64_t>{1, 5, 9});
}
