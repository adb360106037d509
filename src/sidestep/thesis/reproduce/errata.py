"""The errata of the thesis's text: what is wrong, what is right, and the test that shows it.

`python -m sidestep.thesis.reproduce.errata > docs/results/errata.md` writes the page of the documentation.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from sidestep.thesis.reproduce.item import Caption, Item, Table
from sidestep.thesis.reproduce.registry import Settings


@dataclass(frozen=True)
class Erratum:
    """One error.

    Attributes:
        number: by which other pages refer to it.
        place: equation or section.
        wrong: what is printed.
        right: the correct form.
        effect: its consequence.
        test: in tests/thesis/reproduce/test_errata_*.py.
    """

    number: int
    place: str
    wrong: str
    right: str
    effect: str
    test: str


_CHAIN, _GAUSS = "test_errata_kinematics.py", "test_errata_derivatives.py"
_GEOMETRY, _SYSTEM = "test_errata_geometry.py", "test_errata_system.py"

ERRATA: tuple[Erratum, ...] = (
    Erratum(
        1,
        "T3.8, T4.6, T4.16, and the example R₂ = Rₓ(q₂)Rₓ(q₁)",
        "The product of rotations goes from tip to base, over i + 1 factors, without the fixed placements "
        "of the joints. T4.16 has a stray ∂/∂q_p and omits p < q.",
        "Rᵢ = F₁A₁(q₁) F₂A₂(q₂) … FᵢAᵢ(qᵢ), from base to tip, Fₙ the fixed rotation of joint n. "
        "∂²Rᵢ/∂q_p∂q_q puts S beside A_p and beside A_q, for every p and q.",
        "The example has parallel axes, so the order does not matter there. On a real arm the poses are "
        "wrong.",
        f"{_CHAIN}::test_rotations_multiply_from_base_to_tip",
    ),
    Erratum(
        2,
        "Section 4.2.2, after S := ∂R/∂θ Rᵀ",
        "RS = ∂R/∂θ.",
        "∂R/∂θ = S R.",
        "Equal for one rotation about a fixed axis, which commutes with its S; wrong for a product of "
        "rotations.",
        f"{_CHAIN}::test_derivative_of_a_rotation_is_s_times_r",
    ),
    Erratum(
        3,
        "Section 2.1, distance in Euclidean space",
        "Squares are subtracted.",
        "d(x, y)² is the sum of the squares (xⁱ - yⁱ)².",
        "The printed root is of a negative number for most points.",
        f"{_GEOMETRY}::test_distance_adds_squares",
    ),
    Erratum(
        4,
        "T4.2 and section 4.2.4",
        "(2π)^(d/2), where d is the number of joints.",
        "(2π)^(3/2): x lies in the task space. T3.2 has it right.",
        "ψ wrong by (2π)² for seven joints, and with it every threshold κ.",
        f"{_GAUSS}::test_dimension_is_that_of_the_task_space",
    ),
    Erratum(
        5,
        "T4.10, T4.14",
        "∂N/∂Σ lacks the derivative of the determinant.",
        "∂N/∂Σ = ½ N (Σ⁻¹(x-μ)(x-μ)ᵀΣ⁻¹ - Σ⁻¹).",
        "None for ψ(q): a rotation keeps |Σ|, so tr(Σ⁻¹∂Σ/∂q) = 0. Wrong for any other change of Σ.",
        f"{_GAUSS}::test_derivative_by_covariance_has_the_determinant",
    ),
    Erratum(
        6,
        "T4.17",
        "The mixed term is 2 ∂Rᵢ/∂q Σ (∂Rᵢ/∂q)ᵀ.",
        "∂R/∂q_j Σ ∂R/∂q_kᵀ + ∂R/∂q_k Σ ∂R/∂q_jᵀ.",
        "Right only for j = k; for j ≠ k the second derivative of a symmetric Σ is not even symmetric.",
        f"{_GAUSS}::test_second_derivative_of_a_covariance",
    ),
    Erratum(
        7,
        "T5.2, T5.3, and Γᵏᵢⱼ in section 4.3",
        "g_km x''ᵏ + Γᵏᵢⱼ x'ⁱx'ʲ has different free indices; T5.3 has k three times; section 4.3 gives "
        "symbols of the first kind an upper index.",
        "With Γ of the first kind: g_km x''ᵏ = -Γ_mij x'ⁱx'ʲ, so x''ᵏ = -gᵏᵐ Γ_mij x'ⁱx'ʲ. With the second "
        "kind: x''ᵏ = -Γᵏᵢⱼ x'ⁱx'ʲ, and no further gᵏᵐ.",
        "Read with the Γ of T2.11, the metric is inverted twice; then vᵀGv is not kept.",
        f"{_GEOMETRY}::test_geodesic_keeps_its_speed_only_with_one_inverse",
    ),
    Erratum(
        8,
        "T6.2",
        "-σ(G⁻¹K(q + q*) - Dq').",
        "-σ(G⁻¹K(q - q*) + Dq').",
        "As printed the goal is -q*, and damping accelerates. T5.4 and T5.6 are right in the text we have; "
        "in T5.4 the leading minus is outside the brace.",
        f"{_SYSTEM}::test_signs_of_the_switched_system",
    ),
    Erratum(
        9,
        "T5.7, T5.11",
        "Scalar functions in ζ take the vector q. In T5.11 the exponent 4 of the first denominator is at "
        "its numerator, and one factor of the second has q⁺ instead of q⁻.",
        "ζ is a sum over joints. With s the sigmoid of slope α, each step adds α² s(1-s)(1-2s) to the "
        "diagonal of the Hessian.",
        "The printed T5.11 is wrong by orders of magnitude away from the limit. T5.10 is right.",
        f"{_SYSTEM}::test_second_derivative_of_the_limit_potential",
    ),
    Erratum(
        10,
        "T6.3",
        "M q'' = q'ᵀC q' + τ + ζ lacks gravity. W is 6 × 6. ζ is the slack here and the potential in T5.7. "
        "q⁻ ≤ q ≤ q⁺ bounds a variable that the program does not have.",
        "M q'' + C q' + g = τ (+ slack), W of size d × d, and limits of position and velocity as bounds "
        "on q''.",
        "With the printed sign and without gravity, the arm's acceleration differs from that of the program.",
        f"{_SYSTEM}::test_equation_of_motion",
    ),
    Erratum(
        11,
        "Section 5.5.1",
        "The equations are said to stay the same while an obstacle moves.",
        "ψ then depends on time: ψ'' has terms with the velocity of the obstacle, even for an arm at rest.",
        "The geodesic term lags behind; the avoidance of an approaching obstacle is too weak.",
        f"{_SYSTEM}::test_a_moving_obstacle_changes_the_equations",
    ),
    Erratum(
        12,
        "Sections 1 (contribution) and 5.3",
        "The method is said to avoid obstacles without local minima; T5.4 is said to stop in front of the "
        "obstacle.",
        "The goal is the only equilibrium of T5.4, since the geodesic term vanishes at rest and G is "
        "positive definite. But the time over the hill grows with |∇ψ|². Motions from different starts "
        "gather at one point in front of the obstacle and practically stay there, although a free path "
        "exists. With the switch of T5.6 every configuration with ψ > κ is an equilibrium.",
        "Either the motion goes through the hill (contact), or it stalls. See figure 5.4 and the test: 600 "
        "s, 0.92 rad from the goal, 3·10⁻⁵ rad/s. Reactive avoidance needs global guidance.",
        f"{_SYSTEM}::test_the_unswitched_system_stalls_although_a_way_exists",
    ),
    Erratum(
        13,
        "T2.5, T2.6, and the symbols after T2.11",
        "The last term has g_μν x''^μ where the free index is λ. The symbols of the second kind contract "
        "g^λm with derivatives that carry λ, not m.",
        "g_μλ x''^μ; Γ^λ_μν = ½ g^λm (∂_ν g_mμ + ∂_μ g_mν - ∂_m g_μν).",
        "As printed, the second kind is the first kind times the row sums of G⁻¹.",
        f"{_GEOMETRY}::test_second_kind_contracts_the_inner_index",
    ),
    Erratum(
        14,
        "Section 5.4, figure 5.6",
        "ζ of T5.7 is said to be a border that the system does not cross.",
        "ζ is bounded, so its wall has a finite length in the metric. A geodesic with speed u normal to a "
        "wall of height H climbs it in a time of about H / u. Behind it, it has its old speed again.",
        "Joint limits hold only during the climb. The torque controller must keep them.",
        f"{_SYSTEM}::test_a_bounded_wall_only_delays_a_geodesic",
    ),
    Erratum(
        15,
        "Sections 3.3.4 and 5.2",
        "The higher the probability, the greater the curvature.",
        "Curvature depends on the second derivatives of ψ: K = det(∇²ψ) / (1 + |∇ψ|²)². It is positive on "
        "top of a hill, zero where the slope is steepest, and negative at the foot. A constant added to ψ "
        "changes nothing.",
        "Between two obstacles ψ is high but its slope can be zero: nothing bends a motion there.",
        f"{_GEOMETRY}::test_curvature_does_not_follow_height",
    ),
    Erratum(
        16,
        "Appendix A",
        "ψᵢⱼ adds ψ of links i and j, as functions of the two joints, to a sum over all configurations.",
        "ψ of a link depends on all joints below it. For a plot over two joints, take the mean of ψ over "
        "the others.",
        "The sum grows with the number of configurations, and weights links i and j differently from the "
        "others.",
        f"{_CHAIN}::test_a_link_depends_on_all_joints_below_it",
    ),
    Erratum(
        17,
        "T5.6, and the claim of stability in section 1",
        "The switch is said to have no side effects except that it is abrupt.",
        "Where the spring acts (ψ ≤ κ), ψ has a slope, and without the geodesic term vᵀGv changes. Beyond "
        "the switch the geodesic keeps the higher value. Each passage can add energy.",
        "Bursts of velocity, as in the thesis's figures 6.3 and 6.5; a smoother switch does not prevent "
        "them. T2.12 dissipates: ½(vᵀGv + Kx²) never grows.",
        f"{_SYSTEM}::test_the_switch_adds_energy",
    ),
    Erratum(
        18,
        "Section 2.3",
        "A manifold of dimension d is said to have an embedded representation in R^(d+1).",
        "Not in general: the graph of one ψ gives only metrics with G - I of rank one. For several "
        "obstacles use several extra coordinates, G = I + JᵀJ.",
        "The sphere of the example is no graph either; half of it is.",
        f"{_GEOMETRY}::test_a_graph_has_a_metric_of_rank_one_beyond_the_identity",
    ),
    Erratum(
        19,
        "Section 5.1",
        "In flat space the motion of T5.1 is said to follow a straight line.",
        "Only if K and D are multiples of the identity (and the first velocity points along the line).",
        "Unequal gains bend the path in flat space.",
        f"{_SYSTEM}::test_unequal_gains_bend_the_path_in_flat_space",
    ),
    Erratum(
        20,
        "Section 6.2.1",
        "q + q'dt + ½q''dt² is called the Euler method.",
        "It is the Taylor step of second order; section 5.1 uses semi-implicit Euler, q + (q' + q''dt)dt.",
        "The two differ by ½q''dt² per step. Sidestep has both.",
        f"{_SYSTEM}::test_the_update_is_not_eulers",
    ),
    Erratum(
        21,
        "Smaller slips: T2.1, T2.10, T3.5, T4.7, T4.9, section 4.2, section 5.5.2",
        "A geodesic as a curve of stationary points; a covector equated to a vector; the neutral rotation "
        "as 0; Σ_i,0 as the previous covariance; ½(column + row), justified by positive "
        "semi-definiteness; ∇ψ up to q_n; ϕ for ψ.",
        "A stationary point of the action; the index raised by g; R = I; the covariance in the link's frame; "
        "Σ⁻¹(x-μ) by symmetry, and Σ positive definite so that Σ⁻¹ exists; up to q_d; ψ.",
        "Only the wording is wrong; T4.9's result is right.",
        f"{_GAUSS}::test_derivative_by_the_mean",
    ),
)


def errata(_: Settings) -> Iterator[Item]:
    """The table for the report."""
    yield Table(
        key="errata",
        title="Errata of the thesis's text",
        caption=Caption(
            shows="Each error found, its correction, what follows from it, and the test that proves it.",
            answers="The text of the thesis, chapters 1 to 6 and appendix A; equations are written T5.4.",
            parameters="Tests are in tests/thesis/reproduce/.",
            differs="Items 1 to 12 were known before; 2, 8 and 12 are stated more narrowly here than they "
            "were, after checking; 13 to 21 were found on the way.",
        ),
        columns=("no.", "where", "in print", "correct", "effect", "test"),
        rows=tuple((str(e.number), e.place, e.wrong, e.right, e.effect, e.test) for e in ERRATA),
    )


def markdown() -> str:
    """The page docs/results/errata.md."""
    lines = [
        "# Errata of the thesis",
        "",
        "Errors in the text of B. Bosc, *Geometric Dynamical Systems for Obstacle Avoidance in Manipulator",
        "Configuration Space* (2024). Equations are written T5.4. Every item has a test in",
        "`tests/thesis/reproduce/`. It shows that the printed form is wrong and the corrected one right. The report of",
        "`sidestep reproduce` has the same list. `python -m sidestep.thesis.reproduce.errata` writes this page.",
        "",
    ]
    for e in ERRATA:
        lines += [
            f"## {e.number}. {e.place}",
            "",
            f"- **In print:** {e.wrong}",
            f"- **Correct:** {e.right}",
            f"- **Effect:** {e.effect}",
            f"- **Test:** `{e.test}`",
            "",
        ]
    return "\n".join(lines)


if __name__ == "__main__":
    print(markdown(), end="")
