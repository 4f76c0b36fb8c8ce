// The chains of chain.h in Simbody: joint coordinates, the recursive equations of motion, its own integrators. The cost
// is an unknown of its own there too, under error control like the others.
#ifdef COSTATE_BENCH_SIMBODY
#include "chain_simbody.h"

#include <Simbody.h>

#include "chain_facts.h"

namespace costate::bench {

namespace {

using namespace SimTK;

/// |end - its first place|^2 as the rate of an auxiliary unknown; no force.
class SquaredDistance : public Force::Custom::Implementation {
 public:
  SquaredDistance(const GeneralForceSubsystem& forces, const MobilizedBody& body, const Vec3& station,
                  const Vec3& target)
      : forces_(forces), body_(body), station_(station), target_(target) {}
  void calcForce(const SimTK::State&, Vector_<SpatialVec>&, Vector_<Vec3>&, Vector&) const override {}
  Real calcPotentialEnergy(const SimTK::State&) const override { return 0; }
  bool dependsOnlyOnPositions() const override { return true; }
  void realizeTopology(SimTK::State& state) const override { index_ = forces_.allocateZ(state, Vector(1, Real(0))); }
  void realizeAcceleration(const SimTK::State& state) const override {
    forces_.updZDot(state)[index_] = (body_.findStationLocationInGround(state, station_) - target_).normSqr();
  }
  Real value(const SimTK::State& state) const { return forces_.getZ(state)[index_]; }

 private:
  const GeneralForceSubsystem& forces_;
  MobilizedBody body_;
  Vec3 station_, target_;
  mutable ZIndex index_;
};

}  // namespace

struct SimbodyChain::Model {
  MultibodySystem system;
  SimbodyMatterSubsystem matter{system};
  GeneralForceSubsystem forces{system};
  Force::Gravity gravity{forces, matter, Vec3(0, -kChainGravity, 0)};
  SquaredDistance* cost = nullptr;  // of the subsystem
  SimTK::State start;
};

SimbodyChain::SimbodyChain(int bars, bool spatial) : model_(std::make_unique<Model>()) {
  Model& m = *model_;
  const Vec3 end(kChainLength, 0, 0), middle(kChainLength / 2, 0, 0);
  const auto& I = kSpatialInertia;
  const Inertia own = spatial ? Inertia(I[0], I[1], I[2]) : Inertia(0, 1, 1) * (kChainMass * square(kChainLength) / 12);
  const Body::Rigid rod(MassProperties(kChainMass, middle, own.shiftFromMassCenter(middle, kChainMass)));
  MobilizedBody last = m.matter.updGround();
  Vec3 place(0);
  for (int i = 1; i <= bars; ++i) {
    const Transform joint(i == 1 ? Vec3(0) : end);
    if (spatial) {
      last = MobilizedBody::Ball(last, joint, rod, Transform());
    } else {
      MobilizedBody::Pin pin(last, joint, rod, Transform());
      if (i == 1) pin.setDefaultAngle(-Pi / 4);
      last = pin;
    }
    const auto at = spatial ? spatial_chain_point(i) : planar_chain_point(i);
    const auto tie = spatial ? spatial_chain_anchor(i) : planar_chain_anchor(i);
    place = Vec3(at[0], at[1], at[2]);
    const Vec3 anchor(tie[0], tie[1], tie[2]);
    Force::TwoPointLinearSpring(m.forces, m.matter.updGround(), anchor, last, end, kChainStiffness, kChainDepth);
    Force::TwoPointLinearDamper(m.forces, m.matter.updGround(), anchor, last, end, kChainDamping);
  }
  m.cost = new SquaredDistance(m.forces, last, end, place);
  Force::Custom(m.forces, m.cost);
  m.start = m.system.realizeTopology();
  m.system.realizeModel(m.start);
}

SimbodyChain::~SimbodyChain() = default;

SimbodyRun SimbodyChain::run(double accuracy, const std::string& integrator, double t_end) const {
  const Model& m = *model_;
  std::unique_ptr<Integrator> of;
  if (integrator == "feldberg") {
    of = std::make_unique<RungeKuttaFeldbergIntegrator>(m.system);
  } else {
    of = std::make_unique<RungeKuttaMersonIntegrator>(m.system);
  }
  of->setAccuracy(accuracy);
  of->setFinalTime(t_end);
  of->initialize(m.start);
  while (of->getTime() < t_end && of->stepTo(t_end) != Integrator::EndOfSimulation) {
  }
  return {m.cost->value(of->getState()), static_cast<long>(of->getNumStepsTaken())};
}

}  // namespace costate::bench
#endif
