// Exceptions in callbacks of C libraries: kept, and thrown again with their own type.
#include "costate/sundials/callback_guard.h"

#include <catch2/catch.hpp>
#include <stdexcept>

using costate::CallbackGuard;

TEST_CASE("callback guard: success", "[guard]") {
  CallbackGuard guard;
  int calls = 0;
  CHECK(guard.run([&] { ++calls; }) == 0);
  CHECK(calls == 1);
  CHECK_FALSE(guard.failed());
  guard.rethrow();  // nothing to throw
}

TEST_CASE("callback guard: the first exception is kept with its type", "[guard]") {
  CallbackGuard guard;
  CHECK(guard.run([] { throw std::out_of_range("first"); }) == -1);
  CHECK(guard.run([] { throw std::runtime_error("second"); }) == -1);
  CHECK(guard.failed());
  CHECK_THROWS_AS(guard.rethrow(), std::out_of_range);
  CHECK_FALSE(guard.failed());
  guard.rethrow();  // thrown once only
  CHECK(guard.run([] { throw 5; }) == -1);
  CHECK_THROWS_AS(guard.rethrow(), int);
}

TEST_CASE("callback guard: a step error asks for a shorter step", "[guard]") {
  CallbackGuard guard;
  CHECK(guard.run([] { throw costate::StepError("too far"); }) == 1);
  CHECK_FALSE(guard.failed());
  CHECK(guard.last_step_error() == "too far");
  guard.rethrow();
}
