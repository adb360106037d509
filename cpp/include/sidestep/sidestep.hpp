#pragma once

// Everything that a control program needs.
#include "sidestep/controller/controller.hpp"
#include "sidestep/controller/motion.hpp"
#include "sidestep/loop/ideal_driver.hpp"
#include "sidestep/loop/loop.hpp"
#include "sidestep/perception/perception.hpp"
#include "sidestep/arm/arm.hpp"
#include "sidestep/scene/obstacles.hpp"
#include "sidestep/scene/velocity_estimate.hpp"
