# SPDX-License-Identifier: GPL-3.0-or-later
"""The inputs of the nodes that are read.

The native table of parameters says which inputs of a Principled BSDF are modelled in this version
of Blender; it takes precedence over the rows here.
"""

from __future__ import annotations

from .rows import By, Effect, Row, Table


def _names(text: str) -> tuple[str, ...]:
    """Names of inputs hold spaces, so commas separate them."""
    return tuple(" ".join(name.split()) for name in text.split(",") if name.strip())


def _modelled(text: str) -> Row:
    return Row(_names(text), Effect.MODELLED)


def _no_effect(text: str) -> Row:
    return Row(_names(text), Effect.NO_EFFECT)


def _refused_by_reader(text: str) -> Row:
    return Row(_names(text), Effect.REFUSED, by=By.READER)


def _not_modelled(name: str, covers: str = "") -> Row:
    """A weight that is taken as 0; `covers`: what acts only with it."""
    return Row(
        (name,),
        Effect.WARNED,
        0.0,
        "'{label}' is not modelled; rendered as 0",
        "set it to 0, if the photo shows nothing of it",
        covers=_names(covers),
    )


_PRINCIPLED = Table(
    "ShaderNodeBsdfPrincipled",
    (
        _modelled("""
            Base Color, Metallic, Roughness, IOR, Alpha, Emission Strength,
            Specular IOR Level, Specular Tint, Transmission Weight, Diffuse Roughness,
            Subsurface Weight, Subsurface Radius, Subsurface Scale, Subsurface IOR,
            Subsurface Anisotropy, Coat Weight, Coat Roughness, Coat IOR, Coat Tint,
            Sheen Weight, Sheen Roughness, Sheen Tint, Emission Color,
            Specular, Transmission, Transmission Roughness, Emission
        """),
        _not_modelled("Anisotropic", covers="Anisotropic Rotation, Tangent"),
        _not_modelled("Subsurface", covers="Subsurface Color"),
        _not_modelled("Sheen"),
        _not_modelled("Clearcoat", covers="Clearcoat Roughness"),
        _not_modelled("Thin Film Thickness", covers="Thin Film IOR"),
        _not_modelled("Thin Wall"),
        _not_modelled(
            "Transmission Dispersion Scale", covers="Transmission Dispersion Abbe Number"
        ),
        _modelled("Normal"),
        _refused_by_reader("Coat Normal, Clearcoat Normal"),
        _no_effect("Weight"),
    ),
)
_SCATTERING = "Anisotropy, IOR, Backscatter, Alpha, Diameter"

INPUTS = {
    item.type: item
    for item in (
        _PRINCIPLED,
        Table("ShaderNodeBackground", (_modelled("Color, Strength"), _no_effect("Weight"))),
        Table("ShaderNodeEmission", (_modelled("Color, Strength"), _no_effect("Weight"))),
        Table(
            "ShaderNodeOutputMaterial",
            (
                _modelled("Surface, Volume"),
                _refused_by_reader("Displacement"),
                _no_effect("Thickness"),
            ),
        ),
        Table("ShaderNodeOutputWorld", (_modelled("Surface"), _refused_by_reader("Volume"))),
        Table("ShaderNodeOutputLight", (_modelled("Surface"),)),
        Table("ShaderNodeTexImage", (_modelled("Vector"),)),
        Table("ShaderNodeTexEnvironment", (_modelled("Vector"),)),
        Table("ShaderNodeMapping", (_modelled("Vector, Location, Rotation, Scale"),)),
        Table("ShaderNodeAddShader", (_modelled("Shader"),)),
        Table(
            "ShaderNodeVolumePrincipled",
            (
                _modelled("""
                    Color, Color Attribute, Density, Density Attribute, Anisotropy,
                    Absorption Color
                """),
                _refused_by_reader("""
                    Emission Strength, Emission Color, Blackbody Intensity, Blackbody Tint,
                    Temperature, Temperature Attribute
                """),
                _no_effect("Weight"),
            ),
        ),
        Table("ShaderNodeVolumeAbsorption", (_modelled("Color, Density"), _no_effect("Weight"))),
        # The phase functions with further inputs are refused.
        Table(
            "ShaderNodeVolumeScatter",
            (_modelled("Color, Density," + _SCATTERING), _no_effect("Weight")),
        ),
        Table(
            "ShaderNodeVolumeCoefficients",
            (
                _modelled("Absorption Coefficients, Scatter Coefficients," + _SCATTERING),
                _refused_by_reader("Emission Coefficients"),
                _no_effect("Weight"),
            ),
        ),
    )
}
