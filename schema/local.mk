# Generated from the tables of kinds: make regen.
zs_schemas += \
  schema/zeroset.rng \
  schema/zeroset.xsd
