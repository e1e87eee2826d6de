//! The JSON Schema of reports, and the check that a report keeps to it.
//!
//! The check knows the keywords of the schema and no others, so that none is passed over.

use serde_json::Value;

/// Checks a report against its schema, and that every key that is `null` has its reason.
#[track_caller]
pub fn assert_report(report: &Value) {
    let schema: Value = serde_json::from_str(idmesh::report::SCHEMA).unwrap();
    let mut faults = Vec::new();
    check(&schema, &schema, report, String::new(), &mut faults);
    let mut reasons: Vec<&str> = report["reasons"].as_object().unwrap().keys().map(String::as_str).collect();
    let mut nulls = Vec::new();
    find_nulls(report, String::new(), &mut nulls);
    nulls.sort_unstable();
    reasons.sort_unstable();
    if nulls != reasons {
        faults.push(format!("null are {nulls:?}, but reasons are given for {reasons:?}"));
    }
    // Exit codes, verdict and error say the same.
    let good = report["exit"] == 0;
    if good != report["error"].is_null() || good && report["valid"] != true {
        faults.push(format!("exit {}, valid {}, error {}", report["exit"], report["valid"], report["error"]));
    }
    assert!(faults.is_empty(), "{faults:#?} in {report:#}");
}

/// What is wrong with a case by its schema.
#[allow(dead_code, reason = "some tests have reports alone")]
pub fn faults_of_case(case: &str) -> Vec<String> {
    let schema: Value = serde_json::from_str(idmesh::case::SCHEMA).unwrap();
    let case: toml::Table = case.parse().unwrap();
    let mut faults = Vec::new();
    check(&schema, &schema, &serde_json::to_value(case).unwrap(), String::new(), &mut faults);
    faults
}

fn find_nulls(value: &Value, pointer: String, nulls: &mut Vec<String>) {
    match value {
        Value::Null => nulls.push(pointer),
        Value::Object(map) => map.iter().for_each(|(key, value)| {
            find_nulls(value, format!("{pointer}/{}", key.replace('~', "~0").replace('/', "~1")), nulls);
        }),
        Value::Array(values) => {
            values.iter().enumerate().for_each(|(at, value)| find_nulls(value, format!("{pointer}/{at}"), nulls));
        }
        _ => {}
    }
}

/// Adds what is wrong with `value` at `place`. Keywords as JSON Schema 2020-12 defines them.
fn check(root: &Value, schema: &Value, value: &Value, place: String, faults: &mut Vec<String>) {
    for (keyword, wanted) in schema.as_object().unwrap() {
        let number = || value.as_f64().unwrap_or_default();
        let holds = match keyword.as_str() {
            "$schema" | "$defs" | "definitions" | "title" | "description" => true,
            "$ref" => {
                let target = root.pointer(wanted.as_str().unwrap().strip_prefix('#').unwrap()).unwrap();
                check(root, target, value, place.clone(), faults);
                true
            }
            "type" => match wanted {
                Value::Array(types) => types.iter().any(|wanted| has_type(value, wanted.as_str().unwrap())),
                wanted => has_type(value, wanted.as_str().unwrap()),
            },
            "enum" => wanted.as_array().unwrap().contains(value),
            "minimum" => !value.is_number() || number() >= wanted.as_f64().unwrap(),
            "exclusiveMinimum" => !value.is_number() || number() > wanted.as_f64().unwrap(),
            "minLength" => value.as_str().is_none_or(|text| text.len() as u64 >= wanted.as_u64().unwrap()),
            "anyOf" => wanted.as_array().unwrap().iter().any(|one| {
                let mut faults = Vec::new();
                check(root, one, value, place.clone(), &mut faults);
                faults.is_empty()
            }),
            "maximum" => !value.is_number() || number() <= wanted.as_f64().unwrap(),
            "minItems" => value.as_array().is_none_or(|items| items.len() >= wanted.as_u64().unwrap() as usize),
            "maxItems" => value.as_array().is_none_or(|items| items.len() <= wanted.as_u64().unwrap() as usize),
            "required" => value
                .as_object()
                .is_none_or(|map| wanted.as_array().unwrap().iter().all(|key| map.contains_key(key.as_str().unwrap()))),
            "properties" => {
                for (key, value) in value.as_object().into_iter().flatten() {
                    if let Some(schema) = wanted.get(key) {
                        check(root, schema, value, format!("{place}/{key}"), faults);
                    }
                }
                true
            }
            "additionalProperties" => value.as_object().is_none_or(|map| {
                let known = |key: &String| schema.get("properties").is_some_and(|known| known.get(key).is_some());
                let others: Vec<_> = map.iter().filter(|(key, _)| !known(key)).collect();
                if wanted.is_boolean() {
                    return wanted == true || others.is_empty();
                }
                for (key, value) in others {
                    check(root, wanted, value, format!("{place}/{key}"), faults);
                }
                true
            }),
            "items" => {
                for (at, value) in value.as_array().into_iter().flatten().enumerate() {
                    check(root, wanted, value, format!("{place}/{at}"), faults);
                }
                true
            }
            other => panic!("the schema has the keyword {other}, which this check does not know"),
        };
        if !holds {
            faults.push(format!("{place}: {keyword} {wanted}, found {value}"));
        }
    }
}

fn has_type(value: &Value, name: &str) -> bool {
    match name {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "string" => value.is_string(),
        "object" => value.is_object(),
        "array" => value.is_array(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        other => panic!("the schema has the type {other}, which this check does not know"),
    }
}
