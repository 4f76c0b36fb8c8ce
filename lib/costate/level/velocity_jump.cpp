#include "costate/level/velocity_jump.h"

namespace costate {

namespace {
class LevelBalance final : public ImpulseBalance {
 public:
  explicit LevelBalance(AccelerationLevel& level) : level_(level) {}
  void prepare(const StateView& s) override { level_.prepare(s); }
  void solve(double* b) override { level_.solve_kkt(b); }

 private:
  AccelerationLevel& level_;
};
}  // namespace

VelocityJump::VelocityJump(Assembly& assembly, AccelerationLevel& level)
    : ImpulseJump(assembly, std::make_unique<LevelBalance>(level)) {}

}  // namespace costate
