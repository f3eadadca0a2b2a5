// The application's callbacks: they may throw or call back, and nothing of it gets into the library
// or through it.
#include <doctest/doctest.h>

#include <atomic>
#include <cfenv>
#include <csignal>
#include <stdexcept>
#include <thread>

#include "sdk/base/os/aligned_memory.hpp"
#include "sdk/testing/test_context.hpp"
#include "sdk/testing/test_files.hpp"
#include "sdk/testing/test_frames.hpp"

using namespace defrec;
using namespace defrec::test;

namespace {

defrec_context_desc base_desc() {
    defrec_context_desc desc;
    DEFREC_INIT(&desc);
    desc.flags = DEFREC_CONTEXT_ONLY_GIVEN_PLUGINS;
    desc.threads = 2;
    return desc;
}

// A rig that is not an identity needs memory and a parallel loop.
defrec_rig_desc turned_rig() {
    defrec_rig_desc desc = small_rig();
    desc.left.fy = 71;
    return desc;
}

defrec_status make_rig(const defrec_context_desc& desc) {
    defrec_context context = nullptr;
    defrec_status status = defrec_context_create(&desc, &context);
    if (status != DEFREC_OK) return status;
    const defrec_rig_desc rig_desc = turned_rig();
    defrec_rig rig = nullptr;
    status = defrec_rig_create(context, &rig_desc, &rig);
    defrec_rig_destroy(rig);
    defrec_context_destroy(context);
    return status;
}

// Counts what is alive.
struct Memory {
    std::atomic<int> live{0}, total{0};
    static void* take(void* user, size_t size, size_t alignment) {
        auto& memory = *static_cast<Memory*>(user);
        ++memory.live;
        ++memory.total;
        return allocate_aligned(size, alignment);
    }
    static void give(void* user, void* pointer) {
        --static_cast<Memory*>(user)->live;
        free_aligned(pointer);
    }
};

void run_in_order(void*, size_t count, void (*body)(void*, size_t), void* arg) {
    for (size_t i = 0; i < count; ++i) body(arg, i);
}

}  // namespace

TEST_CASE("the application's memory and threads are used, and all memory comes back") {
    Memory memory;
    defrec_context_desc desc = base_desc();
    desc.alloc = Memory::take;
    desc.free = Memory::give;
    desc.alloc_user = &memory;
    desc.parallel_for = run_in_order;
    CHECK(make_rig(desc) == DEFREC_OK);
    CHECK(memory.total > 0);
    CHECK(memory.live == 0);
}

TEST_CASE("two contexts with different allocators do not mix") {
    Memory memory[2];
    defrec_context context[2];
    defrec_rig rig[2];
    const defrec_rig_desc rig_desc = turned_rig();
    for (int i = 0; i < 2; ++i) {
        defrec_context_desc desc = base_desc();
        desc.alloc = Memory::take;
        desc.free = Memory::give;
        desc.alloc_user = &memory[i];
        REQUIRE(defrec_context_create(&desc, &context[i]) == DEFREC_OK);
        REQUIRE(defrec_rig_create(context[i], &rig_desc, &rig[i]) == DEFREC_OK);
    }
    CHECK(memory[0].live == memory[1].live);
    defrec_rig_destroy(rig[0]);
    CHECK(memory[0].live == 0);
    CHECK(memory[1].live > 0);
    defrec_context_destroy(context[1]);
    defrec_rig_destroy(rig[1]);
    CHECK(memory[1].live == 0);
    defrec_context_destroy(context[0]);
}

TEST_CASE("alloc without free is refused") {
    defrec_context_desc desc = base_desc();
    desc.alloc = Memory::take;
    CHECK(make_rig(desc) == DEFREC_ERROR_ARGUMENT);
}

TEST_CASE("row 26: a callback that throws does no harm") {
    defrec_context_desc desc = base_desc();
    const std::string nowhere = "relative";
    const char* places[] = {nowhere.c_str()};
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.log = [](void*, int32_t, const char*, const char*) { throw std::runtime_error("log"); };
    CHECK(make_rig(desc) == DEFREC_OK);
    desc.alloc = [](void*, size_t, size_t) -> void* { throw 5; };
    desc.free = [](void*, void*) {};
    CHECK(make_rig(desc) == DEFREC_ERROR_OUT_OF_MEMORY);
    desc = base_desc();
    desc.parallel_for = [](void*, size_t, void (*)(void*, size_t), void*) { throw 5; };
    CHECK(make_rig(desc) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), "parallel_for"));
}

TEST_CASE("row 26: a parallel_for that leaves bodies out, or calls beyond the end, is noticed") {
    defrec_context_desc desc = base_desc();
    desc.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 1; i < count; ++i) body(arg, i);
    };
    CHECK(make_rig(desc) == DEFREC_ERROR_STATE);
    desc.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 0; i < count + 100; ++i) body(arg, i);
    };
    CHECK(make_rig(desc) == DEFREC_OK);
}

TEST_CASE("row 84: a parallel_for that calls one body twice and leaves one out is noticed") {
    defrec_context_desc desc = base_desc();
    desc.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 1; i < count; ++i) body(arg, i);
        body(arg, count - 1);
    };
    CHECK(make_rig(desc) == DEFREC_ERROR_STATE);
    CHECK(contains(defrec_last_error(), "did not call every body once"));
}

TEST_CASE("row 84: a parallel_for that calls a body twice as well runs it once") {
    defrec_context_desc desc = base_desc();
    desc.parallel_for = [](void*, size_t count, void (*body)(void*, size_t), void* arg) {
        for (size_t i = 0; i < 2 * count; ++i) body(arg, i % count);
    };
    CHECK(make_rig(desc) == DEFREC_OK);
}

TEST_CASE("row 84: bodies that a parallel_for calls after its return do nothing") {
    struct Late {
        void (*body)(void*, size_t);
        void* arg;
        size_t count;
    };
    std::vector<Late> calls;
    defrec_context_desc desc = base_desc();
    desc.parallel_for_user = &calls;
    desc.parallel_for = [](void* user, size_t count, void (*body)(void*, size_t), void* arg) {
        static_cast<std::vector<Late>*>(user)->push_back({body, arg, count});
    };
    CHECK(make_rig(desc) == DEFREC_ERROR_STATE);
    REQUIRE(!calls.empty());
    for (const Late& call : calls)
        for (size_t i = 0; i < call.count; ++i) call.body(call.arg, i);
}

TEST_CASE("row 84: what bodies use stays until those that run when a parallel_for returns end") {
    struct Early {
        std::thread thread;
        std::atomic<bool> begun{false};
    } early;
    defrec_context_desc desc = base_desc();
    desc.parallel_for_user = &early;
    desc.parallel_for = [](void* user, size_t count, void (*body)(void*, size_t), void* arg) {
        auto& self = *static_cast<Early*>(user);
        if (self.thread.joinable()) self.thread.join();
        self.begun = false;
        self.thread = std::thread([=, &self] {
            self.begun = true;
            for (size_t i = 0; i < count; ++i) body(arg, i);
        });
        while (!self.begun) std::this_thread::yield();
    };
    // Whether a body had begun when it returned is a matter of chance.
    for (int i = 0; i < 20; ++i) {
        const defrec_status status = make_rig(desc);
        CHECK((status == DEFREC_OK || status == DEFREC_ERROR_STATE));
    }
    early.thread.join();
}

TEST_CASE("row 101: memory of the application that is not aligned as asked counts as none") {
    struct Log {
        std::string text;
        static void add(void* user, int32_t, const char*, const char* text) {
            static_cast<Log*>(user)->text += text;
        }
    } log;
    defrec_context_desc desc = base_desc();
    desc.log = Log::add;
    desc.log_user = &log;
    desc.alloc = [](void*, size_t size, size_t) -> void* {
        return static_cast<char*>(allocate_aligned(size + 64, 64)) + 8;
    };
    desc.free = [](void*, void* memory) { free_aligned(static_cast<char*>(memory) - 8); };
    CHECK(make_rig(desc) == DEFREC_ERROR_OUT_OF_MEMORY);
    CHECK(contains(log.text, "multiple of the alignment"));
}

TEST_CASE("row 27: a call from a callback is a state error and changes nothing") {
    struct Inside {
        defrec_context context = nullptr;
        defrec_status status = DEFREC_OK;
        int calls = 0;
    } inside;
    const TestContext other;
    inside.context = other.get();
    defrec_context_desc desc = base_desc();
    const char* places[] = {"relative"};
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.log_user = &inside;
    desc.log = [](void* user, int32_t, const char*, const char*) {
        auto& self = *static_cast<Inside*>(user);
        const defrec_rig_desc rig_desc = small_rig();
        defrec_rig rig = nullptr;
        self.status = defrec_rig_create(self.context, &rig_desc, &rig);
        defrec_context_destroy(self.context);
        ++self.calls;
    };
    CHECK(make_rig(desc) == DEFREC_OK);
    CHECK(inside.calls == 1);
    CHECK(inside.status == DEFREC_ERROR_STATE);
    const defrec_rig_desc rig_desc = small_rig();
    defrec_rig rig = nullptr;
    CHECK(defrec_rig_create(other.get(), &rig_desc, &rig) == DEFREC_OK);
    defrec_rig_destroy(rig);
}

TEST_CASE("the log's level is kept") {
    int calls = 0;
    defrec_context_desc desc = base_desc();
    const char* places[] = {"relative"};
    desc.plugin_paths = places;
    desc.plugin_path_count = 1;
    desc.log_user = &calls;
    desc.log = [](void* user, int32_t level, const char*, const char*) {
        CHECK(level == DEFREC_LOG_WARNING);
        ++*static_cast<int*>(user);
    };
    desc.log_level = DEFREC_LOG_ERROR;
    CHECK(make_rig(desc) == DEFREC_OK);
    CHECK(calls == 0);
    desc.log_level = DEFREC_LOG_WARNING;
    CHECK(make_rig(desc) == DEFREC_OK);
    CHECK(calls == 1);
}

TEST_CASE("row 31: the application's rounding mode neither changes nor matters") {
    const TestContext context;
    const defrec_rig_desc desc = turned_rig();
    const double raw[] = {10.3, 20.7};
    double results[2][2];
    const int modes[] = {FE_TONEAREST, FE_UPWARD};
    for (int i = 0; i < 2; ++i) {
        REQUIRE(std::fesetround(modes[i]) == 0);
        defrec_rig rig = nullptr;
        const defrec_status created = defrec_rig_create(context.get(), &desc, &rig);
        const defrec_status converted = defrec_rig_rectify_pixels(rig, raw, 1, results[i]);
        defrec_rig_destroy(rig);
        const int after = std::fegetround();
        std::fesetround(FE_TONEAREST);
        CHECK(created == DEFREC_OK);
        CHECK(converted == DEFREC_OK);
        CHECK(after == modes[i]);
    }
    CHECK(results[0][0] == results[1][0]);
    CHECK(results[0][1] == results[1][1]);
}

TEST_CASE("row 28: two threads in one handle are serialised or busy, never wrong") {
    const TestContext context({stub_folder("good").string()});
    const defrec_ransac_params params = small_ransac();
    defrec_stage stage = nullptr;
    REQUIRE(defrec_stage_create(context.get(), nullptr, DEFREC_STAGE_RANSAC, &params, &stage) ==
            DEFREC_OK);
    std::vector<uint8_t> nothing(48);
    const defrec_const_buffer landmarks{nothing.data(), nothing.size()};
    REQUIRE(defrec_stage_prepare(stage, &landmarks, 1) == DEFREC_OK);
    std::atomic<int> good{0}, busy{0}, wrong{0};
    std::vector<std::thread> threads;
    for (int t = 0; t < 3; ++t)
        threads.emplace_back([&, t] {
            std::vector<uint8_t> in(4000, uint8_t(t + 1)), out(4000);
            for (int i = 0; i < 300; ++i) {
                const defrec_const_buffer from{in.data(), in.size()};
                const defrec_buffer to{out.data(), out.size()};
                const defrec_status status = defrec_stage_run(stage, &from, 1, &to, 1);
                if (status == DEFREC_ERROR_BUSY)
                    ++busy;
                else if (status == DEFREC_OK && in == out)
                    ++good;
                else
                    ++wrong;
            }
        });
    for (std::thread& thread : threads) thread.join();
    CHECK(wrong == 0);
    CHECK(good > 0);
    CHECK(good + busy == 900);
    defrec_stage_destroy(stage);
}

TEST_CASE("the last error belongs to its thread") {
    CHECK(defrec_rig_get(nullptr, nullptr) == DEFREC_ERROR_ARGUMENT);
    const std::string mine = defrec_last_error();
    std::string before, after;
    std::thread other([&] {
        before = defrec_last_error();
        defrec_job_wait(nullptr, 0);
        after = defrec_last_error();
    });
    other.join();
    CHECK(before.empty());
    CHECK(contains(after, "job"));
    CHECK(std::string(defrec_last_error()) == mine);
}
